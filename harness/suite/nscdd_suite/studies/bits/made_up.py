"""Made-up results, for tests of the page: no value here was ever counted, simulated or measured."""
from ...made_up import made_up


def bits(**changed):
    """The JSON of two builds, one of which has another answer and another work by DCS, and another number in a hard case."""
    answers = {"biaxial auto nlgs 1 answer": "00aa", "biaxial auto dcs 8 answer": "00bb"}
    row = {"build": "g++-v4", "compiler": "g++ 0", "lanes": 8, "numbers": 24, "differ": [], "hard": {"same": 20, "of": 20}, "answers": answers}
    differ = ["biaxial auto dcs 8 answer", "biaxial auto dcs 8 work", "hard: row nlgs: found"]
    other = {"build": "clang-v3", "differ": differ, "hard": {"same": 19, "of": 20}, "answers": answers | {"biaxial auto dcs 8 answer": "00cc"}}
    return made_up("bits", accepted="fabricated", rows=[row, row | other]) | changed
