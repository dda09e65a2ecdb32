"""The soft pad under load: a bonded rubber block, its shape factor and its compression. SI units throughout.

A target that covers only part of its pad loads that part. Two bonded blocks enclose what the pad then does, because by
the principle of minimum potential energy no elastic body becomes stiffer when material is cut away or a surface let go:

* the part under the target, cut out of the pad, gives way more than the real pad, whose surround hinders the bulging;
* the whole pad under a rigid plate gives way less than the real pad, whose surface beside the target is free.

The strain that is stated is that of the first block: too large rather than too small. `least_strain` is the second's.
The law of a block is `pad_law`'s: within a few percent of finite elements (`pad_law.sigma`). The surround adds 18 to
116 % to the stiffness of the first block (discs of 1 to 2 pad thicknesses' radius, small strains).
"""

from __future__ import annotations

import math
from functools import lru_cache

from sitscad.basics.record import record, replace
from sitscad.kernels.mechanics import pad_law
from sitscad.kernels.mechanics.pad_law import NEO_HOOKEAN
from sitscad.kernels.mechanics.surround_law import NO_WEBS, Webs

VALID_STRAIN = 0.30
"""Compressive strain that a pad should not pass: it creeps, and what was held against finite elements ends at 35 %."""

VALID_SHEAR = 1.0
"""Shear strain (travel over thickness) up to which F = G A gamma is trusted. A conservative figure, unverified: what
EN 1337-3 allows laminated bearings for horizontal movement (from memory); the principal stretch is then 1.62. Soft
silicones stretch further, but their bond to board and target peels, edges lift, and the target comes down as it goes.
"""

DOUBTED = 0.10  # Share of the strain by which the two blocks may differ before the formula counts as out of its range

BESIDE = 0.01
"""How far a force may act beside the middle of a face, in parts of the face's length, before that counts as tilting it:
the far edge of a level block would then give way by 6 % more (1 + 6 e / a, as in a beam's section)."""

SOURCE = (
    "pressure between bonded plates by the torsion function (Gent & Lindley 1959, Gent & Meinecke 1970), large strain "
    "F = (Ea A/3)(1/lambda^2 - lambda) (Lindley; from memory), what they leave open fitted to our own finite elements "
    "(tests/oracles/pad_elements); a pad loaded over part of its area: the loaded part cut out, a lower bound of "
    "the stiffness by minimum potential energy (textbook; held by our finite elements)"
)

SHEAR_SOURCE = (
    "shear strain of 100 %: EN 1337-3 for laminated bearings (from memory, unverified), taken as careful here"
)


WITHIN = "bonded block, within the range of its law"  # What to think of a strain that there is nothing to say of


@record
class Face:
    """A loaded face, about the same centre as any other: widths along x and y (m), and how `round` it is.

    0 is a rectangle, 1 an ellipse; between them lies what two crossing outlines have in common: of the area that an
    ellipse lacks of its rectangle it lacks this share.
    """

    width_x: float
    width_y: float
    round: float = 0.0

    @property
    def area(self) -> float:
        """Area (m2): of the rectangle, less a share of the 1 - pi / 4 of it that an ellipse lacks."""
        return (1.0 - (1.0 - math.pi / 4.0) * self.round) * self.width_x * self.width_y

    @property
    def oblongness(self) -> float:
        """Length over width, no unit."""
        return max(self.width_x, self.width_y) / min(self.width_x, self.width_y)

    def grown(self, width: float) -> Face:
        """The face wider by so much (m) both ways, never less than a twentieth of it."""
        return Face(
            max(0.05 * self.width_x, self.width_x + width), max(0.05 * self.width_y, self.width_y + width), self.round
        )


@record
class Surround:
    """What is around a loaded face: by how much the pad reaches beyond it (m; see `even_rim`), and the thickness (m),
    shear modulus (Pa) and Ogden's exponent of a film that is bonded round pad and target, and the webs (their width in
    m) that join the pad to its neighbours.
    """

    rim: float = 0.0
    film: float = 0.0
    film_modulus: float = 0.0
    film_exponent: float = NEO_HOOKEAN
    webs: Webs = NO_WEBS

    def block(self, face: Face, thickness: float, shear_modulus: float, exponent: float = NEO_HOOKEAN) -> pad_law.Block:
        """The face with its surround in thicknesses (m) and shear moduli (Pa), as it looks along x; `exponent` is
        Ogden's, of the pad (no unit).
        """
        widths, rim = (face.width_x / thickness, face.width_y / thickness), self.rim / thickness
        film = self.film / thickness, self.film_modulus / shear_modulus
        webs = replace(self.webs, width=self.webs.width / thickness)
        return pad_law.Block(*widths, float(face.round), rim, *film, exponent, self.film_exponent, webs)


BARE = Surround()

EVEN = 0.2
"""Thicknesses by which the rims of a pad to the four sides of its target may differ, as far as the law was held."""


def even_rim(pad: Face, face: Face, aside: tuple[float, float], thickness: float) -> float | None:
    """Width (m) by which a pad reaches beyond a face whose middle lies `aside` (m; x, y) from its own; None where that
    is not nearly the same on all sides, so that no law was held against it. Rims wider than the thickness count as
    alike: what is beyond it counts, and comes in without a step, as the narrowest rim nears the thickness. Derived
    here, by comparison with finite elements (tests/validation/pad_figures.csv).
    """
    spare = 0.5 * (pad.width_x - face.width_x), 0.5 * (pad.width_y - face.width_y)
    rooms = [max(0.0, room + way * off) for room, off in zip(spare, aside, strict=True) for way in (-1, 1)]
    rims = [min(room, thickness) for room in rooms]
    if max(rims) - min(rims) > EVEN * thickness:
        return None
    wide = max(0.0, min(rims) / thickness - (1.0 - EVEN)) / EVEN
    return (sum(rims) + wide * (sum(rooms) - sum(rims))) / 4.0


@record
class Compression:
    """A pad under a force: engineering strain (0 to 1), the thickness that is left (m), the shape factor, the apparent
    modulus (Pa), and whether the formula is within its range; `note` says so in words.

    `least_strain` is what the strain can be at least (the same where the whole pad is loaded), `loaded_share` the
    loaded share of the pad's area, `loaded_area` that area (m2), to which shape factor and modulus belong.
    """

    strain: float
    gap: float
    shape_factor: float
    apparent_modulus: float
    valid: bool
    note: str
    least_strain: float = math.nan
    loaded_area: float = math.nan
    loaded_share: float = 1.0

    @property
    def doubt(self) -> float:
        """One sigma (no unit, as the strain) by which the strain is too large where part of the pad is loaded.

        All strains from the least to the stated one being as likely as each other, this is their root mean square
        distance from the stated one: the difference over sqrt 3 (of an even distribution, textbook).
        """
        return (self.strain - self.least_strain) / math.sqrt(3.0)


def shape_factor(face: Face, thickness: float) -> float:
    """Loaded area over force-free area (no unit) of a face on a pad of a thickness (m): ab/(2h(a + b)) for a rectangle,
    d/(4h) for a disc (Gent and Lindley 1959).

    Of a face that is partly round the perimeter lies between both like its area (an octagon's: within 0.1 %); that of
    an ellipse is Ramanujan's (1914, error below 5e-4).
    """
    both = face.width_x + face.width_y
    h = ((face.width_x - face.width_y) / both) ** 2
    ellipse = math.pi / 2.0 * both * (1.0 + 3.0 * h / (10.0 + math.sqrt(4.0 - 3.0 * h)))
    around = (1.0 - face.round) * 2.0 * both + face.round * ellipse
    return face.area / (around * thickness)


@lru_cache(maxsize=1024)  # designs of a study, trials for hints and states press one pad
def compress(
    face: Face, thickness: float, shear_modulus: float, bulk_modulus: float, force: float, around: Surround = BARE,
    exponent: float = NEO_HOOKEAN,
) -> Compression:
    """How far a bonded pad gives way under a normal force, with what is `around` the loaded face.

    Thickness in metres, moduli in pascals, force in newtons (0 or more, compressive). `pad_law.compression`:
    F = Ea A e for small strains e, and the neo-Hookean bar for slender pads, or Ogden's of one term and its
    exponent. Raises ValueError for sizes or moduli that are not positive or a negative force.
    """
    if not all(value > 0.0 for value in (face.width_x, face.width_y, thickness, shear_modulus, bulk_modulus)):
        raise ValueError("a pad needs positive widths, thickness and moduli")
    if not force >= 0.0:
        raise ValueError("the compressive force must be 0 or more")
    law = pad_law.compression(around.block(face, thickness, shear_modulus, exponent), bulk_modulus / shear_modulus)
    strain = law.strain(force / (shear_modulus * face.area))
    reasons = _beyond(strain, face, thickness)
    return Compression(
        strain, thickness * (1.0 - strain), shape_factor(face, thickness), shear_modulus * law.at_rest, not reasons,
        "; ".join(reasons) or WITHIN, strain, face.area,
    )


def press_part(
    pad: Face, face: Face, thickness: float, shear_modulus: float, bulk_modulus: float, force: float,
    beside: float = 0.0, around: Surround | None = None, exponent: float = NEO_HOOKEAN,
) -> Compression:
    """How far the loaded part of a pad gives way, `face` being that part and `beside` how far (m) the force acts from
    its middle; units as in `compress`.

    With what is `around` the face the law says the strain. Where that is not known (None), the stated strain is that of
    the loaded part cut out of the pad, an upper bound as far as the law holds, and the whole pad under a rigid plate
    gives `least_strain`.
    """
    found = compress(face, thickness, shear_modulus, bulk_modulus, force, around or BARE, exponent)
    share = min(1.0, face.area / pad.area)
    reasons = _beyond(found.strain, face, thickness)
    if around is None:
        whole = compress(pad, thickness, shear_modulus, bulk_modulus, force, exponent=exponent)
        found = replace(found, least_strain=min(found.strain, whole.strain))
        if found.strain - found.least_strain > DOUBTED * found.strain:
            reasons.append(
                f"the target loads {100.0 * share:.0f} % of the pad: the strain lies between "
                f"{100.0 * found.least_strain:.1f} % (all of it loaded) and {100.0 * found.strain:.1f} % (the loaded "
                "part cut out); the larger is stated, and the change per newton that follows from it is the largest, "
                "too"
            )
    if beside > BESIDE * max(face.width_x, face.width_y):
        reasons.append(
            f"the target's middle stands {1e3 * beside:.3g} mm beside the middle of what it loads of the pad: it "
            "tilts, and this is the strain of a target that is held level"
        )
    return replace(found, valid=not reasons, note="; ".join(reasons) or WITHIN, loaded_share=share)


def force_for_strain(
    strain: float, face: Face, thickness: float, shear_modulus: float, bulk_modulus: float, around: Surround = BARE,
    exponent: float = NEO_HOOKEAN,
) -> float:
    """The force (N) that compresses the pad by an engineering strain (0 to below 1): the inverse of `compress`, whose
    units it has. Raises ValueError for other strains.
    """
    if not 0.0 <= strain < 1.0:
        raise ValueError("a compressive strain lies from 0 to below 1")
    law = pad_law.compression(around.block(face, thickness, shear_modulus, exponent), bulk_modulus / shear_modulus)
    return shear_modulus * face.area * law.at(strain)


def _beyond(strain: float, face: Face, thickness: float) -> list[str]:
    """Why the law is not within its range for a strain of a face on a pad (m); empty where it is."""
    reasons = []
    if strain > VALID_STRAIN:
        reasons.append(
            f"extrapolated: {100.0 * strain:.0f} % strain is beyond the {100.0 * VALID_STRAIN:.0f} % "
            "up to which the pad's law is trusted"
        )
    if face.oblongness > pad_law.OBLONG:
        reasons.append(
            f"the loaded face is {face.oblongness:.2g} times as long as wide: beyond {pad_law.OBLONG:g} the pad's law "
            "was not held against finite elements"
        )
    if BARE.block(face, thickness, 1.0).shape_factor > pad_law.FLATTEST:
        reasons.append(
            f"the loaded face is so wide against the {1e3 * thickness:.3g} mm below it that the pad's law was not held "
            "against finite elements"
        )
    return reasons
