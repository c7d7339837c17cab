"""New programs for the e-puck1: the file, the protocol of its Tiny Bootloader, and the upload over a transport."""

from elib.tools.flash.image import Image as Image
from elib.tools.flash.image import read_image as read_image
from elib.tools.flash.protocol import Phase as Phase
from elib.tools.flash.protocol import Upload as Upload
from elib.tools.flash.uploader import Uploader as Uploader
