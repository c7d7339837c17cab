"""New programs for the e-puck1: the file, the protocol of its Tiny Bootloader, and the upload over a transport."""

from elib.flash.image import Image as Image
from elib.flash.image import read_image as read_image
from elib.flash.protocol import Phase as Phase
from elib.flash.protocol import Upload as Upload
from elib.flash.uploader import Uploader as Uploader
