"""What tests of several files of this folder are given."""

from served_rig import seen

__all__ = ["seen"]
