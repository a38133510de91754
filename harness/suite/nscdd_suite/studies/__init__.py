"""All studies. A new one is a file here, with a class of Study, and its name below."""
import functools
import importlib

from ..study import Study

# In the order of the page.
NAMES = (
    *("paper", "physics", "rheology", "gallery", "peers", "reduced", "bits", "hard", "accuracy", "problems", "acceleration"),
    *("velocity_error", "wild", "partitions", "scaling", "million", "memory", "step_cost", "python_step", "python_solve"),
)


@functools.cache
def studies():
    """{name: study}."""
    modules = [importlib.import_module(f".{name}", __name__) for name in NAMES]
    return {one.name: one() for module in modules for one in vars(module).values() if isinstance(one, type) and issubclass(one, Study) and one is not Study}
