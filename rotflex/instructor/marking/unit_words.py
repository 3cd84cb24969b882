"""Units as people write them on axes, in the languages that they write.

A new language is a few words more. Symbols take the letters of prefixes (ms, мс), names take their words
(Millisekunden, 毫秒). All are written in small letters. They are read by :mod:`rotflex.instructor.marking.named_units`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rotflex.units import DEG


@dataclass(frozen=True)
class Unit:
    """A unit, its size in the SI's, and how it is written.

    Attributes
    ----------
    name : for people
    size : one of it, in the SI's unit
    symbols, names : in small letters, with spaces between
    prefixed : whether there are thousandths of it, and thousands
    """

    name: str
    size: float
    symbols: str
    names: str = ""
    prefixed: bool = False


@dataclass(frozen=True)
class Named:
    """What a label names: a unit, perhaps with a prefix or a factor, and its size in the SI's."""

    name: str
    size: float


@dataclass(frozen=True)
class Quantity:
    """The units of a quantity.

    Attributes
    ----------
    units : that it may be drawn in
    usual : that a curve is tried in whose label does not say
    per_time : units of which so many in a time are units of it, too; None where there are none
    """

    units: tuple[Unit, ...]
    usual: tuple[Named, ...]
    per_time: tuple[Unit, ...] = ()

    @property
    def example(self) -> str:
        """As in "s or ms"."""
        return " / ".join(unit.name for unit in self.usual[:2])


_SECOND = Unit(
    "s", 1.0, "s sec secs sek seg sn с сек δ δευτ 秒 초 ث ثا שנ",
    "second seconds sekunde sekunden sekund sekunder sekundy sekunda sekundi sekundes sekundach sekundah "
    "segundo segundos segon segons seconde secondes secondo secondi secunde secunda secundă seconden "
    "saniye saniyede sekunti sekuntia sekuntit sekunteina másodperc másodpercben секунда секунды секунд "
    "секунде секундах секунди δευτερόλεπτο δευτερόλεπτα δευτερολεπτα 秒 秒钟 秒鐘 초 ثانية ثوان ثواني "
    "الثواني بالثواني ثانیه सेकंड सेकण्ड सेकेंड सेकेण्ड giây detik วินาที שניות שנייה",
    prefixed=True,
)  # fmt: skip
_MINUTE = Unit(
    "min", 60.0, "min mins dk мин хв 分 분",
    "minute minutes minuten minuut minuto minutos minuti minut minuty minuter dakika минута минуты минут "
    "минутах хвилина хвилини хвилин λεπτό λεπτά 分钟 分鐘 분 دقيقة دقائق मिनट phút menit",
)  # fmt: skip
_RADIAN = Unit(
    "rad", 1.0, "rad rads рад 弧度 弪 라디안",
    "radian radians radiant radianten radiante radianti radiane radianer radián radiánok radiánban "
    "radianes radianos radiano radiani radiany radianów radianach radiány radiánů radijan radijani "
    "radijana radijanima radyan radiaani radiaania radiaanit radiaaneina bogenmaß bogenmass радиан "
    "радианы радианов радианах радіан радіани радіанів радіанах ακτίνιο ακτίνια ακτινια 弧度 ラジアン "
    "라디안 호도 راديان رادیان بالراديان रेडियन रेडियंस เรเดียน רדיאן רדיאנים",
    prefixed=True,
)  # fmt: skip
_DEGREE = Unit(
    "deg", DEG, "° deg degs grd град 度 도",
    "degree degrees grad grade graden graad grader grados grado degré degrés degre degres graus grau "
    "gradi stopień stopnie stopni stopniach stupeň stupně stupňů stupne stupňov stupanj stupnjevi "
    "stupnjeva stupnjevima derece asteet astetta asteina fok fokban градус градусы градусов градуса "
    "градусах градуси градусів μοίρα μοίρες μοιρες 度 도 درجة درجات الدرجات بالدرجات درجه डिग्री अंश "
    "độ derajat องศา מעלות",
)  # fmt: skip
TURN = Unit(
    "rev", 2 * math.pi, "rev revs об 圈 회전",
    "turn turns revolution revolutions umdrehung umdrehungen tour tours vuelta vueltas volta voltas giro "
    "giri tur obrót obroty оборот обороты оборотов оберт оберти περιστροφές 回転 圈",
)  # fmt: skip
_VOLT = Unit(
    "V", 1.0, "v в 伏 볼트",
    "volt volts volti voltio voltios voltů voltov volty voltia volttia volteina voltban wolt wolty woltów "
    "woltach вольт вольты вольта вольтах вольти вольтів βολτ 伏 伏特 ボルト 볼트 فولت فولط بالفولت वोल्ट "
    "vôn โวลต์ וולט",
    prefixed=True,
)  # fmt: skip
_HERTZ = Unit(
    "Hz", 1.0, "hz гц 赫 헤르츠",
    "hertz hercio hercios hercy герц герца герцах герців герци χερτζ 赫 赫兹 赫茲 ヘルツ 헤르츠 هرتز "
    "हर्ट्ज hertsi hertsiä เฮิรตซ์",
    prefixed=True,
)  # fmt: skip

TIME = Quantity((_SECOND, _MINUTE), (Named("s", 1.0), Named("ms", 1e-3), Named("min", 60.0), Named("μs", 1e-6)))
ANGLE = Quantity((_DEGREE, _RADIAN, TURN), (Named("deg", DEG), Named("rad", 1.0), Named("mrad", 1e-3)))
VOLTAGE = Quantity((_VOLT,), (Named("V", 1.0), Named("mV", 1e-3)))
FREQUENCY = Quantity(
    (_HERTZ,),
    (Named("Hz", 1.0), Named("rad/s", 0.5 / math.pi), Named("kHz", 1e3)),
    per_time=(Unit("1", 1.0, "1 cycles periods"), *(
        Unit(one.name, one.size / TURN.size, one.symbols, one.names, one.prefixed) for one in (_RADIAN, _DEGREE, TURN)
    )),
)  # fmt: skip

#: Size → name, letters before symbols, words before names.
PREFIXES = {
    1e-3: ("m", "m м", "milli mili милли мілі милі μιλι 毫 ミリ 밀리 ميلي मिली"),
    1e-6: ("μ", "μ u мк", "micro mikro микро мікро μικρο 微 マイクロ 마이크로 ميكرو"),
    1e3: ("k", "k к", "kilo кило кіло χιλιο 千 キロ 킬로 كيلو"),
}
