"""What words of G-code mean: those that do not move the tool, and those that are refused, with reason and remedy."""

from __future__ import annotations

from dataclasses import dataclass

_COMPENSATION = (
    "the controller shifts the path by a cutter radius that the file does not hold",
    "export the path of the tool's centre",
)
_SPINDLE = ("the feed follows the turn of the spindle, which this machine does not measure", "cut threads elsewhere")
_PROBE = ("the move ends where a probe touches", "take probing out of the file")
_SPLINE = ("a spline that the controller interpolates", "export lines and arcs")
_SCALED = ("scaling or mirroring by the controller", "export it applied")
POLAR = ("polar coordinates", "export X and Y")
_PROGRAM = ("the path is in another program", "export without subprograms and macros")
_CYCLE = ("a cycle that is not read", "export it as moves")

REFUSED_G: dict[float, tuple[str, str]] = {
    **dict.fromkeys((41.0, 42.0, 41.1, 42.1, 41.2, 42.2, 41.3, 41.4, 42.4, 39.0), _COMPENSATION),
    **dict.fromkeys((33.0, 33.1, 33.2, 34.0, 35.0, 63.0, 74.0, 76.0, 84.0, 84.2, 84.3, 331.0, 332.0), _SPINDLE),
    **dict.fromkeys((31.0, 36.0, 37.0, 38.0, 38.2, 38.3, 38.4, 38.5), _PROBE),
    7.0: ("X is a diameter, or an axis that does not exist", "export a milling program"),
    **dict.fromkeys((5.0, 5.1, 5.2, 5.3, 6.0, 6.1, 6.2, 6.3), _SPLINE),
    **dict.fromkeys((50.1, 51.0, 51.1), _SCALED),
    **dict.fromkeys((12.1, 16.0, 110.0, 111.0, 112.0), POLAR),
    **dict.fromkeys((65.0, 66.0, 66.1, 68.3, 68.4), _PROGRAM),
    **dict.fromkeys((12.0, 13.0, 34.1, 72.0, 75.0, 77.0, 78.0, 87.0, 88.0), _CYCLE),
    96.0: ("the spindle's speed follows the distance from its axis: turning", "export a milling program"),
    254.0: ("offsets that follow the rotary axes", "export with tool centre point programming (G234, G43.4)"),
}

IDLE_G = frozenset({
    4.1, 8.0, 9.1, 10.6, 11.0, 13.1, 15.0, 22.0, 23.0, 25.0, 26.0, 40.0, 40.1, 40.2, 44.0, 45.1,
    50.0, 62.0, 63.1, 64.2, 67.0, 97.0, 103.0, 113.0, 168.0,
})  # fmt: skip
"""Codes that change nothing here: smoothing, limits, compensations off."""

SPEED_G = {5.0: "P", 5.1: "Q"}
"""Splines of LinuxCNC; with this word, and on other controllers, the codes switch high speed on."""

NO_PLACES_G = frozenset({*SPEED_G, 10.6, 22.0, 25.0, 26.0})
"""Codes whose axis words are no places: axes to smooth, a way to retract, limits of the working area."""

REFUSED_M: dict[float, tuple[str, str]] = {
    **dict.fromkeys((96.0, 97.0, 98.0, 99.0, 198.0, 199.0), _PROGRAM),
    430.0: ("kinematics of the user", "export with M428"),
}
SPINDLE_M, COOLANT_M = frozenset({3.0, 4.0, 5.0, 19.0}), frozenset({7.0, 8.0, 9.0})
ENDS_M = frozenset({2.0, 17.0, 30.0})
STOP_M = frozenset({0.0, 1.0})
IDLE_M = frozenset({10.0, 11.0, 12.0, 13.0, 48.0, 49.0, 50.0, 51.0, 52.0, 53.0})
"""Codes that neither move nor switch anything here: clamps, overrides."""

REFUSED_NAMES: dict[str, tuple[str, str]] = {
    **dict.fromkeys(("CIP", "CT", "ASPLINE", "BSPLINE", "CSPLINE", "POLY"), _SPLINE),
    **dict.fromkeys(("MIRROR", "AMIRROR", "SCALE", "ASCALE"), _SCALED),
    **dict.fromkeys(("AP", "RP"), POLAR),
    **dict.fromkeys(("CUT3DC", "CUT3DF", "CUT3DFS", "CUT3DCC"), _COMPENSATION),
    **dict.fromkeys(("TRANSMIT", "TRACYL"), ("a transformation for turned surfaces", "export with TRAORI")),
    **dict.fromkeys(("A2", "B2", "C2"), ("tool axes by Euler angles", "export rotary axes, or A3, B3, C3")),
    "MEAS": _PROBE, "MEAW": _PROBE,
}  # fmt: skip
IDLE_NAMES = frozenset({
    "MSG", "CYCLE832", "COMPON", "COMPOF", "COMPCURV", "COMPCAD", "COMPSURF", "SOFT", "BRISK", "DRIVE", "FFWON",
    "FFWOF", "FNORM", "FLIN", "FCUB", "FGROUP", "FGREF", "ORIWKS", "ORIMKS", "ORIAXES", "ORIVECT", "ORIPLANE",
    "ORICONCW", "ORICONCCW", "ORIC", "ORID", "ORIEULER", "ORIRPY", "OSOF", "OSC", "UPATH", "SPATH", "CFC", "CFTCP",
    "CFIN", "STOPRE", "SETMS", "WORKPIECE", "DIAMOF", "CUT2D", "CUT2DF", "KONT", "NORM", "TOFRAME", "TOROTOF",
    "PAROTOF", "WALIMON", "WALIMOF", "SPOS", "RTLION", "RTLIOF", "ADIS", "ADISPOS", "TOWSTD", "TOWMCS",
    "GROUP_BEGIN", "GROUP_END", "F_HEAD",
})  # fmt: skip
"""Names of Sinumerik that change nothing here: smoothing, orientation between points, messages."""


IDLE_SETTINGS = frozenset({
    "LIMS", "FL", "FGREF", "ACC", "ACCLIMA", "VELOLIMA", "JERKLIMA", "OVR", "OVRA", "SCC", "SPOS", "ADIS", "ADISPOS",
    "CTOL", "OTOL", "ATOL", "SVC", "FZ",
})  # fmt: skip
"""Names of Sinumerik that are set to a number and change nothing here: limits, tolerances, the spindle's position."""


@dataclass(frozen=True)
class Dialect:
    """What differs between controllers.

    switched: tool centre point programming begins when the file switches it on, and not with the file. exact_stop: the
    modal code of exact stops. dwell: letters of the time of G4; milliseconds: P is in milliseconds. pairs: the default
    rotary axes, from the part to the tool, by their letters. equals: words with an equals sign, as Sinumerik has them.
    units: the codes of inch and millimetre.
    """

    name: str
    switched: bool
    exact_stop: float
    dwell: str
    milliseconds: bool
    pairs: dict[str, tuple[str, ...]]
    equals: bool = False
    units: str = "G20 or G21"

    @property
    def fanuc(self) -> bool:
        """Whether it is that of Fanuc and its relatives."""
        return self.switched and not self.equals


_SINGLE = {letter: (f"table {letter}",) for letter in "ABC"}
_USUAL = {**_SINGLE, "": (), "AC": ("table C", "table A"), "BC": ("table C", "table B")}

LINUXCNC = Dialect(
    "linuxcnc", False, 61.1, "P", False,
    {**_USUAL, "AB": ("head B", "head A"), "AC": ("table -C", "table -A"), "BC": ("table -C", "table -B")},
)  # fmt: skip
"""XYZAB are pentakins; its tilting tables (xyzac-trt-kins, xyzbc-trt-kins) turn backwards by default."""
ISO = Dialect("iso", True, 61.0, "PXU", True, _USUAL)
SINUMERIK = Dialect("sinumerik", True, 60.0, "F", False, _USUAL, equals=True, units="G70 or G71 (G700, G710)")
