"""Names of sizes, and of a test's temperature and stress, in several languages.

Most names are read part by part: `Windungen (aktiv)`, `D_mean`, `Federinnendurchmesser`, `有效圈数`. Names
whose parts do not tell the size are in a list of phrases: `grip separation`, `b0`.
"""

import re
from collections.abc import Iterable
from functools import lru_cache

from .spelling import plain

# Parts of names in several languages, by their role.
_PARTS: dict[str, tuple[str, ...]] = {
    "diameter": (
        "diameter", "diameters", "dia", "diam", "durchmesser", "diamètre", "diametre", "diametro", "diámetro",
        "ø", "⌀", "直径", "직경", "径", "диаметр",
    ),
    "length": (
        "length", "länge", "laenge", "longueur", "lunghezza", "longitud", "长度", "長さ", "长", "長", "길이",
        "длина",
    ),
    "gauge length": ("标距", "標点間距離", "標点距離", "표점거리"),
    "width": (
        "width", "breite", "largeur", "larghezza", "anchura", "ancho", "宽度", "宽", "幅", "폭",
        "ширина",
    ),
    "thickness": (
        "thickness", "dicke", "stärke", "staerke", "épaisseur", "epaisseur", "spessore", "espesor", "厚度",
        "厚さ", "厚", "두께", "толщина",
    ),
    "area": (
        "area", "querschnitt", "querschnittsfläche", "fläche",
        "section", "截面积", "断面積", "面积", "단면적",
    ),
    "pitch": ("pitch", "steigung", "pas", "passo", "paso", "节距", "螺距", "ピッチ", "피치", "шаг"),
    "count": (
        "number", "no", "nr", "anzahl", "zahl", "nombre", "nb", "count", "numero", "número", "число", "数",
        "數",
    ),
    "counted": ("圈数", "匝数", "巻数", "巻き数", "권수"),
    "coils": ("coils", "turns", "windings", "windungen", "spires", "spire", "espiras", "витков", "витки"),
    "coil": ("coil", "winding", "turn", "windung", "wickel", "圈", "コイル"),
    "spring": (
        "spring", "feder", "ressort", "molla", "muelle", "弹簧", "ばね", "スプリング", "스프링", "пружины",
    ),
    "wire": ("wire", "draht", "fil", "filo", "alambre", "线", "線", "丝", "ワイヤ", "와이어", "проволоки"),
    "mandrel": ("mandrel", "dorn", "wickeldorn", "mandrin", "mandrino", "芯轴", "芯棒", "マンドレル"),
    "tube": ("tube", "tubing", "schlauch", "rohr", "tuyau", "tubo", "管", "チューブ", "튜브", "трубки"),
    "wall": ("wall", "wand", "paroi", "parete", "pared", "壁", "肉", "стенки"),
    "inner": (
        "inner", "inside", "internal", "innen", "innerer", "innere", "intérieur", "interne", "interno", "内",
        "內", "내", "внутренний",
    ),
    "outer": (
        "outer", "outside", "external", "außen", "aussen", "äußerer", "äußere", "extérieur", "externe",
        "esterno", "exterior", "外", "외", "наружный", "внешний",
    ),
    "mean": ("mean", "middle", "mittlerer", "mittlere", "mittel", "moyen", "medio", "中", "средний"),
    "average": ("average", "平均"),
    "active": (
        "active", "aktiv", "aktive", "aktiver", "federnd", "federnde", "wirksam", "wirksame", "actives",
        "utiles", "working", "effective", "有效", "有効", "유효", "рабочих", "активных",
    ),
    "total": ("total", "gesamt", "totales", "总", "総", "all"),
    "free": (
        "free", "freie", "frei", "libre", "unstretched", "unloaded", "relaxed", "ungespannte", "ungespannt",
        "ruhe", "unbelastete", "自由", "자유", "свободная",
    ),
    "gauge": ("gauge", "gage", "mess", "einspann", "utile", "grip"),
    "specimen": (
        "specimen", "sample", "coupon", "probe", "proben", "éprouvette", "échantillon", "provino", "probeta",
        "试样", "試験片", "試料", "시편", "образца",
    ),
    "initial": (
        "initial", "initiale", "iniziale", "inicial", "anfangs", "original", "ursprüngliche", "undeformed",
        "ausgangs", "初始", "原始", "初期", "начальная",
    ),
    "filler": (
        "of", "the", "der", "des", "du", "de", "la", "d'", "le", "l'", "nominal", "nominale", "measured",
        "properties",
    ),
    "ending": ("s", "n", "e", "er", "en", "es", "em"),
}  # fmt: skip
_ROLE = {part: role for role, parts in _PARTS.items() for part in parts}
_MOST = max(map(len, _ROLE))
# Words that are no parts of longer ones.
_ALONE = {
    "od": ("outer", "diameter"), "id": ("inner", "diameter"), "d": ("diameter",), "n": ("count",),
    "l": ("length",), "t": ("thickness",), "p": ("pitch",), "i": ("inner",), "o": ("outer",),
    "m": ("mean",), "w": ("wire",), "int": ("inner",), "ext": ("outer",), "avg": ("average",),
    "a": ("active",),
    "di": ("inner", "diameter"), "da": ("outer", "diameter"), "dm": ("mean", "diameter"),
    "na": ("count", "active"),
}  # fmt: skip
_NOUNS = frozenset({
    "diameter", "length", "gauge length", "width", "thickness", "area", "pitch", "counted", "coils",
    "mandrel",
})  # fmt: skip
_LONGEST = 60
"""Maximum number of letters of a word that is read: more than twice those of `Windungsaußendurchmesser`."""
_LONG = 5
"""Minimum number of letters of a part that ends an unknown compound by more than chance."""
_SIZES: dict[frozenset[str], str] = {
    frozenset(roles.split("+")): key
    for key, names in {
        "wire_diameter_mm": ("wire+diameter", "spring+wire+diameter", "wire+thickness"),
        "mandrel_diameter_mm": (
            "mandrel", "mandrel+diameter", "coil+inner+diameter", "spring+inner+diameter",
            "spring+coil+inner+diameter", "mandrel+outer+diameter", "coils+inner+diameter",
        ),
        "coil_diameter_mm": (
            "coil+diameter", "spring+diameter", "spring+coil+diameter", "mean+diameter",
            "coil+mean+diameter", "spring+mean+diameter", "spring+coil+mean+diameter", "coils+diameter",
            "coils+mean+diameter",
        ),
        "coil_outer_diameter_mm": (
            "coil+outer+diameter", "spring+outer+diameter", "spring+coil+outer+diameter",
            "coils+outer+diameter",
        ),
        "active_coils": (
            "coils", "count+coils", "counted", "coils+active", "count+coils+active",
            "count+coil+active", "counted+active", "count+active", "spring+coils", "spring+coils+active",
        ),
        "initial_pitch_mm": ("pitch", "coil+pitch", "spring+pitch", "coils+pitch"),
        "free_length_mm": ("free+length", "spring+free+length", "coil+free+length"),
        "gauge_length_mm": (
            "gauge length", "gauge+length", "wire+length", "specimen+gauge+length", "wire+gauge+length",
            "wire+free+length", "specimen+gauge length", "initial+length", "specimen+initial+length",
        ),
        "length": ("length", "specimen+length"),
        "length_mm": ("tube+length",),
        "inner_diameter_mm": ("inner+diameter", "tube+inner+diameter", "specimen+inner+diameter"),
        "outer_diameter_mm": ("outer+diameter", "tube+outer+diameter", "specimen+outer+diameter"),
        "wall_thickness_mm": ("wall+thickness", "tube+wall+thickness", "tube+thickness", "wall"),
        "diameter_mm": ("specimen+diameter", "diameter"),
        "width_mm": ("width", "specimen+width"),
        "thickness_mm": ("thickness", "specimen+thickness"),
        "area_mm2": ("area", "specimen+area"),
    }.items()
    for roles in names
}  # fmt: skip
"""Size by the roles of all parts of its name."""
_PHRASES: dict[str, tuple[str, ...]] = {
    "gauge_length_mm": (
        "gauge", "gage", "gage length standard travel", "gauge length standard travel",
        "gage length fine strain", "grip separation", "grip to grip separation",
        "grip to grip separation at the start position", "initial grip separation", "grip distance",
        "clamp distance", "distance between grips", "distance between clamps", "jaw separation", "l0", "lo",
        "l 0", "l0 course standard", "free length between grips", "active length", "length between grips",
    ),
    "length": (
        "height", "specimen height", "sample height", "initial height", "cylinder height", "h0",
        "puck height", "thickness along the load",
    ),
    "area_mm2": (
        "cross section", "cross sectional area", "cross section area", "initial cross section",
        "specimen cross section", "final area cross section", "s0", "a0 area",
    ),
    "diameter_mm": ("cylinder diameter", "puck diameter", "outer diameter of the specimen", "d0"),
    "coil_diameter_mm": ("diamètre d'enroulement",),
    "active_coils": ("coil count", "windungszahl"),
    "free_length_mm": (
        "rest length", "resting length", "length at rest", "longueur au repos", "lunghezza a riposo",
        "longitud en reposo",
    ),
    "width_mm": ("gauge width", "b0", "w0"),
    "thickness_mm": ("depth", "a0", "t0"),
    "temperature_degC": (
        "temperature", "test temperature", "temperature of the test", "room temperature",
        "ambient temperature", "temp", "testing temperature", "prüftemperatur", "chamber temperature",
    ),
    "stress_MPa": ("constant stress", "applied stress", "hung stress", "stress applied", "bias stress"),
}  # fmt: skip
"""Names whose parts do not tell the size, by the size. A `length` may be that of the whole specimen."""
_KEY = {phrase: key for key, phrases in _PHRASES.items() for phrase in phrases}
_SYMBOLS = {
    "gauge_length_mm": "l", "length": "lh", "area_mm2": "as", "diameter_mm": "d", "width_mm": "bw",
    "thickness_mm": "athds", "wire_diameter_mm": "d", "mandrel_diameter_mm": "d", "coil_diameter_mm": "d",
    "active_coils": "n", "initial_pitch_mm": "p",
}  # fmt: skip
"""Letters by size: machines write one of them behind its name, with or without a 0: `Probenbreite b0`."""
_OF_NO_SIZE = frozenset({"filler", "ending"})
"""Roles of parts that change nothing of a size."""
_STEPS = ("pas", "passo", "paso", "шаг")
"""Words for a pitch that mean any step where they stand alone: `Pas: 0,1 mm`."""
_NUMBERS = frozenset({"n", "na"})
"""Words for a number that stand for one of coils: `N_active`. `No active: 4` may count anything."""
_SPECIMENS = frozenset({"specimen", "spring", "coil", "wire", "tube"})
"""Roles of the words of a label that is no more than the name of a specimen."""


def size_named(name: str) -> str | None:
    """Size that a name states, by its key in `--dimension` or `--constant`; None where it states none.

    The name may be a phrase, consist of known parts, or be one of these with the size's symbol behind it.
    """
    words = plain(re.sub(r"[,.-]", " ", name))
    if key := _KEY.get(words):
        return key
    if found := re.match(r"(.+) ([a-z])[_ ]?[0o]?$", words):
        key = _KEY.get(found[1]) or _size_by_parts(found[1])
        if key in _SYMBOLS and found[2] in _SYMBOLS[key]:
            return key
    return _size_by_parts(name)


def _size_by_parts(name: str) -> str | None:
    """Size whose name consists of known parts alone; None where a part is unknown, or fits no size.

    A letter stands for a size only beside another part: `D_mean`, and not `D`. A name that has several
    meanings is none either: `Pas`, `No active`, `t_w`, `Average diameter`.
    """
    words = _words(name)
    parts = [_parts(word) for word in words]
    if None in parts or (len(words) == 1 and len(words[0]) == 1 and words[0].isascii()):
        return None
    if any(roles and roles[0] == "ending" for roles in parts) or _may_be_other(words, parts):
        return None
    roles = _roles(parts)
    if "average" in roles and roles & {"coil", "coils", "spring"}:
        roles = roles - {"average"} | {"mean"}
    return _SIZES.get(frozenset(roles)) or _SIZES.get(frozenset(roles - {"initial"}))


def _may_be_other(words: list[str], parts: list[tuple[str, ...] | None]) -> bool:
    """True for a name of known parts that means something else as well."""
    telling = [word for word, roles in zip(words, parts, strict=True) if _roles([roles])]
    roles = _roles(parts)
    wall = "w" in words and "diameter" not in roles  # `t_w` is a wall's thickness or a wire's
    counts = roles == {"count", "active"} and not _NUMBERS & {*words}
    return wall or counts or (len(telling) == 1 and telling[0] in _STEPS)


def names_a_specimen(label: str) -> bool:
    """True for a label that only names a specimen: `Spring`, `Specimen A`, `Feder S-7`."""
    words = re.split(r"[\s:#]+", label.strip(" :#"))
    named = [word for word in words if (roles := _parts(word.lower())) and {*roles} <= _SPECIMENS]
    others = [word for word in words if word not in named]
    name = re.compile(r"[A-Z]|\w*-?\d+\w?")
    return bool(named) and len(others) <= 1 and all(name.fullmatch(word) for word in others)


def may_name_a_size(name: str) -> bool:
    """True if a part of a name is that of a size, or if it is all letters and indices: `d`, `L0`, `L/D`."""
    words = _words(name)
    if re.search(r"[^\W\d]", name) and all(re.fullmatch(r"[abdhilnprstwø]?\d?", word) for word in words):
        return True
    parts = [_parts(word) for word in words if word not in _ALONE]
    if "active" in (roles := _roles(parts)) and roles <= {"active", "coil", "count"} and len(roles) > 1:
        return True
    return any(_NOUNS & {*roles} for roles in parts if roles) or any(map(_ends_in_a_size, words))


def names_the_mean(text: str) -> bool:
    """True if the name before a number says that the size is the mean one: `D_mean = 1.15 mm`."""
    return any({"mean", "average"} & {*(_parts(word) or ())} for word in _words(re.split(r"[:=\d]", text)[0]))


def names_the_first(text: str) -> bool:
    """True if the name before a number says that the length is the first one: `Anfangslänge: 56 mm`."""
    return "initial" in _roles(map(_parts, _words(re.split(r"[:=(\d]", text)[0])))


def _ends_in_a_size(word: str) -> bool:
    """True for a compound whose first part is unknown: `Endwindungen`, `Klemmlänge`."""
    return any(word.endswith(part) for part, role in _ROLE.items() if role in _NOUNS and len(part) >= _LONG)


def _words(name: str) -> list[str]:
    text = re.sub(r"[.,;:/\\-]+", " ", plain(name))
    return [word for word in re.split(r"\s+", text.replace("d'", "d' ")) if word]


def _roles(parts: Iterable[tuple[str, ...] | None]) -> set[str]:
    return {role for roles in parts for role in roles or ()} - _OF_NO_SIZE


@lru_cache(maxsize=4096)
def _parts(word: str) -> tuple[str, ...] | None:
    """Roles of the parts of a word, the longest parts first; None where they do not make up the word."""
    if word in _ALONE:
        return _ALONE[word]
    if not word or len(word) > _LONGEST:
        return None if word else ()
    for end in range(min(len(word), _MOST), 0, -1):
        if (role := _ROLE.get(word[:end])) is None:
            continue
        rest = _rest(word[end:])
        if rest is not None:
            return (role, *rest)
    return None


def _rest(word: str) -> tuple[str, ...] | None:
    """Roles of the rest of a compound; letters that stand for a size are words of their own."""
    return None if word in _ALONE else _parts(word)
