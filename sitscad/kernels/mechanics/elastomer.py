"""Compression of a bonded soft pad: strain, gap, shape factor and apparent modulus. SI units.

A target that covers only a part of its pad loads this part. Two bonded blocks bound the strain of the pad. An elastic
body does not become stiffer if material is cut away or a surface is released (principle of minimum potential energy).

* The loaded part, cut out of the pad, is softer than the real pad, because the material round it hinders the bulging.

* The whole pad under a rigid plate is stiffer than the real pad, whose surface beside the target is free.

The returned strain belongs to the first block and is an upper bound. `least_strain` belongs to the second. The law of a
block follows `pad_law` within a few per cent of finite elements (`pad_law.force_sigma`). The surrounding material adds
18 to 116 % to the stiffness of the first block (discs with radii of 1 to 2 pad thicknesses, small strains).
"""

from __future__ import annotations

import math
from functools import lru_cache

from sitscad.basics.record import record, replace
from sitscad.kernels.mechanics import pad_law
from sitscad.kernels.mechanics.pad_law import NEO_HOOKEAN
from sitscad.kernels.mechanics.surround_law import NO_WEBS, Webs

VALID_STRAIN = 0.30
"""Largest compressive strain (displacement divided by thickness) for a pad in use.

At larger strain a pad creeps. The law was compared with finite elements up to a strain of 35 %.
"""

VALID_SHEAR = 1.0
"""Largest shear strain (displacement divided by thickness) for which F = G A gamma is trusted.

It is a conservative value, unverified: EN 1337-3 allows it for horizontal movement of laminated bearings (from memory).
The principal stretch is then 1.62. Soft silicones stretch further, but their bonds to board and target peel, edges
lift, and the target is lowered.
"""

HELD_STRAIN, HELD_SHEAR, HELD_TILT = 0.35, 0.5, math.radians(5.0)
"""Largest validated compressive strain, shear (displacement divided by thickness) and tilt (rad) of the law of `pad`.

Up to these values the law was compared with finite elements.
"""

MAX_STRAIN_DIFFERENCE = 0.10  # of two blocks, over the strain: beyond it the formula counts as out of its range

TILT_DISTANCE_RATIO = 0.01
"""Distance of a force from the middle of the loaded face, divided by the face's length, above which the target tilts.

At this ratio the pressure at one edge is 6 % above the mean: 1 + 6 e / a, as in the section of a beam (distance e,
length a).
"""

SOURCE = (
    "pressure between bonded plates: torsion function (Gent and Lindley 1959, Gent and Meinecke 1970); "
    "large strain: F = (Ea A/3)(1/lambda^2 - lambda) (Lindley, from memory); "
    "remaining coefficients: fitted to own finite elements (tests/oracles/pad_elements); "
    "pad loaded over part of its area: loaded part cut out, a lower bound of the stiffness by minimum potential energy"
)
"""Text with the sources of the compression law."""

SHEAR_SOURCE = (
    "shear strain of 100 %: EN 1337-3 for laminated bearings (from memory, unverified), a careful value"
)
"""Text with the source of the largest shear strain."""


WITHIN = "bonded block, within the range of its law"  # What to think of a strain that there is nothing to say of


@record
class Face:
    """Loaded face of a pad: widths along x and y (`width_x`, `width_y`; m), and a roundness from 0 to 1.

    `round` is 0 for a rectangle and 1 for an ellipse. For the intersection of two outlines it is the area missing from
    the bounding rectangle, divided by the area missing for an ellipse.
    """

    width_x: float
    width_y: float
    round: float = 0.0

    @property
    def area(self) -> float:
        """Loaded area (m2)."""
        return (1.0 - (1.0 - math.pi / 4.0) * self.round) * self.width_x * self.width_y

    @property
    def oblongness(self) -> float:
        """Longer width divided by shorter width, 1 or more."""
        return max(self.width_x, self.width_y) / min(self.width_x, self.width_y)

    def with_added_width(self, width: float) -> Face:
        """Return the face with both widths increased by `width` (m, any sign). At least 5 % of each width remains."""
        return Face(
            max(0.05 * self.width_x, self.width_x + width), max(0.05 * self.width_y, self.width_y + width), self.round
        )


@record
class Surround:
    """Material round a loaded face: rim of the pad, film and webs.

    `rim` (m) is the width by which the pad extends beyond the face on each side (see `even_rim`). The film is bonded to
    pad and target: `film` is its thickness (m), `film_modulus` its shear modulus (Pa), `film_exponent` its Ogden
    exponent. `webs` are strips of the pad's material that join it to neighbouring pads (width in m).
    """

    rim: float = 0.0
    film: float = 0.0
    film_modulus: float = 0.0
    film_exponent: float = NEO_HOOKEAN
    webs: Webs = NO_WEBS

    def block(self, face: Face, thickness: float, shear_modulus: float, exponent: float = NEO_HOOKEAN) -> pad_law.Block:
        """Return a loaded face with its surround as a dimensionless block, with x as its first axis.

        Lengths are divided by the pad's `thickness` (m), moduli by its `shear_modulus` (Pa). `exponent` is the pad's
        Ogden exponent.
        """
        widths, rim = (face.width_x / thickness, face.width_y / thickness), self.rim / thickness
        film = self.film / thickness, self.film_modulus / shear_modulus
        webs = replace(self.webs, width=self.webs.width / thickness)
        return pad_law.Block(*widths, float(face.round), rim, *film, exponent, self.film_exponent, webs)


BARE = Surround()
"""No material round the loaded face."""

EVEN = 0.2
"""Largest validated difference between a pad's widest and narrowest rim (of four), divided by its thickness."""


def even_rim(pad: Face, face: Face, offset: tuple[float, float], thickness: float) -> float | None:
    """Return the mean width (m) of the rim of a pad round a face. None if the four sides differ by more than `EVEN`.

    `offset` (m; x, y) leads from the pad's middle to the face's middle. For the comparison, rims wider than the
    thickness count as one thickness. Their excess width enters the mean gradually as the narrowest rim approaches one
    thickness. The rule is derived here by comparison with finite elements (tests/validation/pad_figures.csv).
    """
    spare = 0.5 * (pad.width_x - face.width_x), 0.5 * (pad.width_y - face.width_y)
    rooms = [max(0.0, room + way * off) for room, off in zip(spare, offset, strict=True) for way in (-1, 1)]
    rims = [min(room, thickness) for room in rooms]
    if max(rims) - min(rims) > EVEN * thickness:
        return None
    wide = max(0.0, min(rims) / thickness - (1.0 - EVEN)) / EVEN
    return (sum(rims) + wide * (sum(rooms) - sum(rims))) / 4.0


@record
class Compression:
    """Compression of a pad under a normal force.

    Attributes
    ----------
    strain : float
        engineering strain: displacement divided by thickness (0 to 1)
    gap : float
        remaining thickness (m)
    shape_factor, apparent_modulus : float
        shape factor (loaded area divided by free side area), and modulus (Pa; pressure divided by small strain)
    valid : bool
        whether the law is within its range; `note` gives the reason if not
    least_strain : float
        lower bound of the strain; equal to `strain` if the whole pad is loaded or the surround is modelled
    loaded_area, loaded_share : float
        loaded area (m2), and its fraction of the pad's area
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
    def strain_uncertainty(self) -> float:
        """Root mean square distance of possible strains from `strain` (no unit), for a pad that is loaded on a part.

        All strains between `least_strain` and `strain` are taken as equally likely. The result is the difference of
        both, divided by sqrt 3 (uniform distribution, textbook).
        """
        return (self.strain - self.least_strain) / math.sqrt(3.0)


def shape_factor(face: Face, thickness: float) -> float:
    """Return the shape factor (no unit): a face's loaded area divided by the free side area of the pad below it.

    `thickness` (m) is the pad's. The factor is ab/(2h(a + b)) for a rectangle and d/(4h) for a disc (Gent and Lindley
    1959). For a partly round face the perimeter is interpolated like the area (for an octagon, the error is 0.1 %). The
    perimeter of an ellipse is Ramanujan's (1914, error below 5e-4).
    """
    sides = face.width_x + face.width_y
    h = ((face.width_x - face.width_y) / sides) ** 2
    ellipse = math.pi / 2.0 * sides * (1.0 + 3.0 * h / (10.0 + math.sqrt(4.0 - 3.0 * h)))
    around = (1.0 - face.round) * 2.0 * sides + face.round * ellipse
    return face.area / (around * thickness)


@lru_cache(maxsize=1024)  # designs of a study, trials for hints and states press one pad
def compress(
    face: Face, thickness: float, shear_modulus: float, bulk_modulus: float, force: float, around: Surround = BARE,
    exponent: float = NEO_HOOKEAN,
) -> Compression:
    """Return the compression of a bonded pad under a normal force on its whole face.

    Parameters
    ----------
    face : Face
        loaded face (m)
    thickness : float
        thickness of the pad (m)
    shear_modulus, bulk_modulus : float
        moduli of the pad (Pa)
    force : float
        normal force (N), 0 or more
    around : Surround
        material round the face
    exponent : float
        Ogden exponent of the pad; 2 is neo-Hookean

    Raises
    ------
    ValueError
        if a size or modulus is not positive, or the force is negative

    Notes
    -----
    The law is `pad_law.compression`: F = Ea A e for small strains e, and the law of a bar for slender pads.
    """
    if not all(value > 0.0 for value in (face.width_x, face.width_y, thickness, shear_modulus, bulk_modulus)):
        raise ValueError("a pad needs positive widths, thickness and moduli")
    if not force >= 0.0:
        raise ValueError("the compressive force must be 0 or more")
    law = pad_law.compression(around.block(face, thickness, shear_modulus, exponent), bulk_modulus / shear_modulus)
    strain = law.strain(force / (shear_modulus * face.area))
    reasons = _range_violations(strain, face, thickness)
    return Compression(
        strain, thickness * (1.0 - strain), shape_factor(face, thickness), shear_modulus * law.at_rest, not reasons,
        "; ".join(reasons) or WITHIN, strain, face.area,
    )


def compress_part(
    pad: Face, face: Face, thickness: float, shear_modulus: float, bulk_modulus: float, force: float,
    beside: float = 0.0, around: Surround | None = None, exponent: float = NEO_HOOKEAN,
) -> Compression:
    """Return the compression of a pad that is loaded on a part of its face.

    `face` is the loaded part and `beside` (m) the distance of the force from its middle. Other parameters are explained
    in `compress`. If `around` is given, the strain includes the effect of this surrounding material. If it is None, the
    strain is an upper bound, for the loaded part cut out of the pad. `least_strain` is then the strain of the whole pad
    under a rigid plate.
    """
    compression = compress(face, thickness, shear_modulus, bulk_modulus, force, around or BARE, exponent)
    share = min(1.0, face.area / pad.area)
    reasons = _range_violations(compression.strain, face, thickness)
    if around is None:
        whole = compress(pad, thickness, shear_modulus, bulk_modulus, force, exponent=exponent)
        compression = replace(compression, least_strain=min(compression.strain, whole.strain))
        if compression.strain - compression.least_strain > MAX_STRAIN_DIFFERENCE * compression.strain:
            reasons.append(
                f"the target loads {100.0 * share:.0f} % of the pad: the strain lies between "
                f"{100.0 * compression.least_strain:.1f} % (all of it loaded) and "
                f"{100.0 * compression.strain:.1f} % (the loaded "
                "part cut out); the larger is stated, and the change per newton that follows from it is the largest, "
                "too"
            )
    if beside > TILT_DISTANCE_RATIO * max(face.width_x, face.width_y):
        reasons.append(
            f"the target's middle stands {1e3 * beside:.3g} mm beside the middle of what it loads of the pad: it "
            "tilts, and this is the strain of a target that is held level"
        )
    return replace(compression, valid=not reasons, note="; ".join(reasons) or WITHIN, loaded_share=share)


def force_for_strain(
    strain: float, face: Face, thickness: float, shear_modulus: float, bulk_modulus: float, around: Surround = BARE,
    exponent: float = NEO_HOOKEAN,
) -> float:
    """Return the normal force (N) that causes an engineering strain (0 to below 1): the inverse of `compress`.

    The other parameters are explained in `compress`. Raises ValueError for strains outside the range.
    """
    if not 0.0 <= strain < 1.0:
        raise ValueError("a compressive strain lies from 0 to below 1")
    law = pad_law.compression(around.block(face, thickness, shear_modulus, exponent), bulk_modulus / shear_modulus)
    return shear_modulus * face.area * law.at(strain)


def _range_violations(strain: float, face: Face, thickness: float) -> list[str]:
    """Return the reasons why the compression law is outside its range for a strain of a face. Empty if it is inside."""
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
