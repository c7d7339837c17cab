"""The answers to ``H`` (wire-protocol.md, 2.8)."""

from __future__ import annotations

_BTCOM = {
    "A": "Accelerometer",
    "B,#": "Body led 0=off 1=on 2=inverse",
    "C": "Selector position",
    "D,#,#": "Set motor speed left,right",
    "E": "Get motor speed left,right",
    "F,#": "Front led 0=off 1=on 2=inverse",
    "G": "IR receiver",
    "H": "Help",
    "I": "Get camera parameter",
    "J,#,#,#,#": "Set camera parameter mode,width,heigth,zoom(1,4 or 8)",
    "K": "Calibrate proximity sensors",
    "L,#,#": "Led number,0=off 1=on 2=inverse",
    "N": "Proximity",
    "O": "Light sensors",
    "P,#,#": "Set motor position left,right",
    "Q": "Get motor position left,right",
    "R": "Reset e-puck",
    "S": "Stop e-puck and turn off leds",
    "T,#": "Play sound 1-5 else stop sound",
    "U": "Get microphone amplitude",
    "V": "Version of SerCom",
}

_J = "J,#,#,#,#,#,#"
_ASERCOM = {
    "A": _BTCOM["A"],
    "B,#": _BTCOM["B,#"],
    "b": "Battery value",
    **{form: _BTCOM[form] for form in ("C", "D,#,#", "E", "F,#", "G")},
    "g": "Gyro",
    "H": _BTCOM["H"],
    "I": _BTCOM["I"],
    _J: "Set camera parameter mode,width,heigth,zoom(1,4 or 8),x1,y1",
    "K": _BTCOM["K"],
    "L,#,#": _BTCOM["L,#,#"],
    "M": "Floor sensors",
    **{form: _BTCOM[form] for form in ("N", "O", "P,#,#", "Q", "R", "S", "T,#")},
    "t": "Temperature",
    "U": _BTCOM["U"],
    "V": _BTCOM["V"],
    "W": "Write I2C (mod,reg,val)",
    "Y": "Read I2C val=(mod,reg)",
}


def _page(entries: dict[str, str], column: int) -> bytes:
    """Set the explanations at *column*, one line each, after an empty line."""
    lines = (f'"{form}"'.ljust(column) + text + "\r\n" for form, text in entries.items())
    return ("\n" + "".join(lines)).encode("ascii")


HELP_BTCOM = _page(_BTCOM, 12).replace(b'"H"         Help', b'"H"\t     Help')
"""Help text of both BTComs; one line has a tab."""

HELP_ASERCOM = _page(_ASERCOM, 18)
"""Help text of asercom on hardware revision 1.3, and of the e-puck2 over Bluetooth."""

HELP_ASERCOM_OLD = _page(
    {
        form: "Battery state (1=ok, 0=low)" if form == "b" else text
        for form, text in _ASERCOM.items()
        if form not in ("g", "t")
    },
    18,
)
"""Help text of asercom on hardware before revision 1.3."""
