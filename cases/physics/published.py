"""Published numbers that results are compared with, and the judge. What is allowed is the published number or range with its error, and a
margin of ours for other samples and loadings, which the rule states. Numbers of Agnolin and of Lovoll, and that P(f) is uniform and then
exponential (Mueth), and the sentence of Srivastava, were checked in the abstracts; the others are quoted from the papers without having been looked up for this file."""
import math

from granular import lade_duncan

SOURCES = {
    "agnolin": "Agnolin, Roux 2007, Phys. Rev. E 76, 061302, doi:10.1103/PhysRevE.76.061302",
    "bolton": "Bolton 1986, Geotechnique 36, 65, doi:10.1680/geot.1986.36.1.65",
    "chialvo": "Chialvo, Sun, Sundaresan 2012, Phys. Rev. E 85, 021305, doi:10.1103/PhysRevE.85.021305",
    "dacruz": "da Cruz, Emam, Prochnow, Roux, Chevoir 2005, Phys. Rev. E 72, 021309, doi:10.1103/PhysRevE.72.021309",
    "lade": "criterion of Lade, Duncan 1975, J. Geotech. Eng. Div. ASCE 101, 1037",
    "midi": "GDR MiDi 2004, Eur. Phys. J. E 14, 341, doi:10.1140/epje/i2003-10153-0",
    "mueth": "Mueth, Jaeger, Nagel 1998, Phys. Rev. E 57, 3164, doi:10.1103/PhysRevE.57.3164",
    "ohern": "O'Hern, Silbert, Liu, Nagel 2003, Phys. Rev. E 68, 011306, doi:10.1103/PhysRevE.68.011306",
    "peyneau": "Peyneau, Roux 2008, Phys. Rev. E 78, 011307, doi:10.1103/PhysRevE.78.011307",
    "radjai96": "Radjai, Jean, Moreau, Roux 1996, Phys. Rev. Lett. 77, 274, doi:10.1103/PhysRevLett.77.274",
    "radjai98": "Radjai, Wolf, Jean, Moreau 1998, Phys. Rev. Lett. 80, 61, doi:10.1103/PhysRevLett.80.61",
    "lovoll": "Lovoll, Maloy, Flekkoy 1999, Phys. Rev. E 60, 5872, doi:10.1103/PhysRevE.60.5872",
    "schofield": "Schofield, Wroth 1968, Critical State Soil Mechanics, McGraw-Hill",
    "silbert": "Silbert, Ertas, Grest, Halsey, Levine 2002, Phys. Rev. E 65, 031304, doi:10.1103/PhysRevE.65.031304",
    "srivastava": "Srivastava and others 2019, Evolution of internal granular structure at the flow-arrest transition, arXiv:1903.00599",
    "tighe": "Tighe, Socolar, Schaeffer, Mitchener, Huber 2005, Phys. Rev. E 72, 031306, doi:10.1103/PhysRevE.72.031306",
    "own": "no publication: the same law from the same start",
}


def source(*keys):
    return "; ".join(SOURCES[key] for key in keys)


SHEAR = 0.357  # shear stress over pressure in slow simple shear of spheres with friction 0.3
FRICTIONLESS = math.tan(math.radians(5.76)), math.tan(math.radians(0.22))  # the same without friction, and its error
MOHR_COULOMB = math.degrees(math.asin(SHEAR))
LADE = lade_duncan(SHEAR)
LADE_FREE = lade_duncan(FRICTIONLESS[0] - FRICTIONLESS[1]), lade_duncan(FRICTIONLESS[0] + FRICTIONLESS[1])


def expect(quantity, unit, published, allowed, rule, source, why):
    """published: a text or a range. allowed: the range of the rule. why: what may explain it, should it differ."""
    return {"quantity": quantity, "unit": unit, "published": published, "allowed": list(allowed), "rule": rule, "source": source, "why": why}


def same(quantity):
    return expect(f"{quantity}: NSCDD (DCS, 8 subdomains) against NLGS, p-value", "1", "one distribution of curves", (0.05, 1),
                  "p of a permutation test at least 0.05", source("own"), "the curves of the two solvers are farther apart than by chance")


def jamming(dimension):
    """Solid fraction, contacts per grain and contacts per degree of freedom at jamming, without friction."""
    what = "spheres" if dimension == 3 else "disks"
    low, high = (0.63, 0.645) if dimension == 3 else (0.835, 0.847)
    exact = "0.639 +- 0.001" if dimension == 3 else "0.842 +- 0.001 (two sizes, 1:1.4)"
    sources = ("ohern", "agnolin") if dimension == 3 else ("ohern",)
    z = 2 * dimension
    return {"solid fraction": expect(f"solid fraction of jammed {what} without friction, core", "1", exact, (low, high),
                                     f"between {low} and {high}: the core is small, sizes spread otherwise", source(*sources),
                                     "a small core fluctuates by 1 over the root of its number of grains"),
            "contacts": expect(f"contacts per grain of jammed {what} without friction, core, no rattlers", "1", [z, z], (0.97 * z, 1.03 * z),
                               f"{z} within 3 %", source(*sources), "gaps are not resolved well enough to tell contacts from near grains"),
            "isostatic": expect(f"contacts per degree of freedom of jammed {what}, with walls, no rattlers", "1", [1, 1], (0.98, 1.02),
                                "1 within 2 %", source("ohern", "agnolin"), "gaps are not resolved well enough to tell contacts from near grains")}


EXPECTED = {
    "sphere angle": expect("friction angle of spheres at the critical state, friction 0.3", "degrees",
                           f"{SHEAR} in simple shear: {LADE:.1f} in triaxial compression by the criterion of Lade and Duncan, "
                           f"{MOHR_COULOMB:.1f} by that of Mohr and Coulomb", (LADE - 1, MOHR_COULOMB + 1),
                           "between the two, within 1 degree", source("chialvo", "lade"), "walls, rate and size of the sample"),
    "sphere fraction": expect("solid fraction of spheres at the critical state, friction 0.3, core", "1", [0.596, 0.596], (0.586, 0.606),
                              "within 0.01: our sizes spread by 10 %, theirs are equal", source("chialvo"),
                              "the core is not yet at the critical state"),
    "sphere dilation": expect("rate of dilation of spheres at the critical state", "1", [0, 0], (-0.03, 0.03), "0 within 0.03",
                              source("schofield"), "more strain is needed"),
    "sphere peak": expect("peak friction angle of spheres above the critical one, less 10 degrees times the rate of dilation", "degrees",
                          [0, 0], (-2, 2), "0 within 2 degrees", source("bolton"), "the relation is of sands, and empirical"),
    "sphere contacts": expect("contacts per grain of spheres at the critical state, no rattlers", "1", [4, 6], (4, 6),
                              "isostatic with and without friction: 4 to 6", source("silbert"), "grains with one or two contacts count too"),
    "sphere rate": expect("friction angle of spheres at half the rate less that at the full rate", "degrees", "none: quasi-static below I = 1e-3",
                          (-0.5, 0.5), "0 within 0.5 degrees", source("midi"), "the inertial number still matters"),
    "free angle": expect("friction angle of spheres without friction, extrapolated to rate 0", "degrees",
                         f"5.76 +- 0.22 in simple shear: {LADE_FREE[0]:.1f} to {LADE_FREE[1]:.1f} in triaxial compression by the criterion of Lade "
                         "and Duncan", (LADE_FREE[0], 5.98), "between the two, their error included", source("peyneau", "lade"),
                         "small samples between walls are stronger, and the power of the rate is approximate"),
    "free dilation": expect("change of the solid fraction of spheres sheared without friction, core", "1", "none: no dilatancy", (-0.005, 0.005),
                            "0 within 0.005", source("peyneau"), "the start was not at random close packing"),
    "disk sine": expect("sine of the friction angle of disks at the critical state, friction 0.3", "1",
                        "about 0.25 in slow plane shear, friction 0.4", (0.22, 0.28), "0.25 within 0.03", source("dacruz"),
                        "another loading, friction and spread of sizes"),
    "disk fraction": expect("solid fraction of disks at the critical state, friction 0.3, core", "1", "about 0.81, friction 0.4", (0.80, 0.82),
                            "0.81 within 0.01", source("dacruz"), "less friction packs denser, and sizes spread otherwise"),
    "disk dilation": expect("rate of dilation of disks at the critical state", "1", [0, 0], (-0.05, 0.05), "0 within 0.05", source("schofield"),
                            "more strain is needed"),
    "sphere fabric": expect("share of the stress ratio that the anisotropy of the contacts makes, spheres at the critical state, friction 0.3", "1",
                            "contacts and forces contribute nearly equally: 0.5", (0.4, 0.6), "0.5 within 0.1, what nearly may mean",
                            source("srivastava"), "theirs are spheres that a given shear stress arrests, of other frictions, read in the abstract alone"),
    "disk decay": expect("decay of P(f) above the mean force, disks in biaxial compression", "1", "1.4", (1.3, 1.5), "1.4 within 0.1",
                         source("radjai96"), "the tail is not one exponential"),
    **{f"{key} tail": expect(f"R\u00b2 of a straight line through ln P(f) above the mean force, {what}", "1", "exponential: 1", (0.99, 1),
                             "at least 0.99", source(*sources), "P(f) falls faster far from the mean than near it: it is not one exponential")
       for key, what, sources in (("disk", "disks in biaxial compression", ("radjai96",)), ("free", "jammed spheres without friction", ("mueth",)),
                                  ("sphere", "spheres at the critical state", ("radjai96", "mueth", "lovoll")))},
    "free decay": expect("decay of P(f) above the mean force, jammed spheres without friction", "1", [1.4, 1.6], (1.3, 1.7),
                         "1.5, twice its error 0.1 allowed", source("mueth"), "theirs are forces on walls, of grains with friction"),
    "sphere decay": expect("decay of P(f) above the mean force, spheres at the critical state", "1", [1.4, 1.8], (1.4, 1.8),
                           "within the range of three sources", source("radjai96", "mueth", "lovoll"),
                           "theirs are not sheared in three dimensions; anisotropic stress broadens the tail (" + SOURCES["tighe"] + ")"),
    "disk power": expect("power of P(f) below the mean force, disks in biaxial compression", "1",
                         "-0.3 (Radjai, Lovoll); nearly uniform, 0 (Mueth)", (-0.4, 0.1), "within the range of three sources, 0.1 more either way",
                         source("radjai96", "lovoll", "mueth"), "forces below the mean are solved to the tolerance only"),
    "weak deviator": expect("share of the deviatoric stress that contacts below the mean force carry, disks", "1", "none but pressure",
                            (-0.1, 0.1), "0 within 0.1", source("radjai98"), "the mean force does not part the networks"),
    "inertia": expect("median inertial number, largest of the runs", "1", "quasi-static: below 1e-3", (0, 1e-3), "at most 1e-3",
                      source("midi", "dacruz"), "the top comes down too fast"),
    "motion": expect("displacement in a step over the smallest radius, 999 of 1,000 grains, largest of the runs", "1", "none: our own bound",
                     (0, 0.01), "at most 0.01", source("own"), "h is too large"),
    "overlap": expect("mean overlap of contacts over the mean diameter, largest of the runs", "1", "0: rigid grains", (0, 1e-3),
                      "at most 1e-3, by which solid fractions are up to 0.3 % too large", source("own"), "overlaps add up over the steps"),
    "energy": expect("energy balance, largest error of all steps and runs", "1", "0, to round-off", (0, 1e-10), "at most 1e-10", source("own"),
                     "works or dissipation are not those of the motion"),
}


def judge(value, error, allowed):
    """agrees: the value is allowed, within its own standard error or not. differs: it is not, nor are two standard errors off. Else it cannot be
    told, nor where there is no number."""
    low, high = allowed
    if value is None or not math.isfinite(value):
        return "cannot be told"
    if low <= value <= high:
        return "agrees"
    spread = 2 * error if error is not None and math.isfinite(error) else 0
    return "cannot be told" if value + spread >= low and value - spread <= high else "differs"


def row(expected, value, error=None, note="", command=""):
    """A comparison; null where there is no finite number."""
    finite = lambda x: round_to(x) if x is not None and math.isfinite(x) else None  # noqa: E731
    verdict = judge(value, error, expected["allowed"])
    why = {"agrees": "", "differs": expected["why"], "cannot be told": "no number" if finite(value) is None else
           "within two standard errors of what is allowed; " + expected["why"]}[verdict]
    told = {key: expected[key] for key in ("quantity", "unit", "published", "allowed", "rule", "source")}
    return {**told, "ours": finite(value), "error": finite(error), "verdict": verdict, "why": why, "note": note, "command": command}


def round_to(value, digits=5):
    return float(f"{value:.{digits}g}")
