"""Captured bytes of a link, decoded into lines that a person can read.

::

    decoder = Decoder()
    for time, direction, data in capture:
        for line in decoder.feed(direction, time, data): ...
    for line in decoder.flush(): ...
"""

from elib.records.decoding.decoder import ASSUMED, Decoder
from elib.records.decoding.lines import FAULTS, Argument, Call, Direction, Kind, Line
from elib.records.decoding.wifi import AnyDecoder, WifiDecoder, decoder_of, is_wifi

__all__ = [
    "ASSUMED",
    "FAULTS",
    "AnyDecoder",
    "Argument",
    "Call",
    "Decoder",
    "Direction",
    "Kind",
    "Line",
    "WifiDecoder",
    "decoder_of",
    "is_wifi",
]
