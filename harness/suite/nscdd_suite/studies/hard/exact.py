"""The exact answers of the scenes of cases/hard, with bounds on the error that come from theory, family by family.

A family is a function of a case (case.py) that makes the runs it needs and yields rows. Everything is taken
from the scene: masses, friction, gravity; no found figure is written down here. A row says where its bound comes from:

    tolerance    an answer of residual eta is that near to the exact one (theory.py)
    O(h)         the step
    round-off    the answer is exact but for the arithmetic
    law          an inequality that must hold whatever the accuracy

Long runs to the default tolerance are judged by their energy: none may come out of nothing. A step that did not converge within the cap of iterations
may be as wrong as it is, for the run then ends with exit code 3; energy it must not gain either. --quick runs a tenth of the steps.
"""
import math
import re
from statistics import linear_regression

import numpy as np

from . import theory

ROUND_OFF = 1e-12  # relative, of sums of some thousand terms
REST = "tolerance: energy of the error"
EVERY_STEP = "tolerance: energy of the error at every step"
IMPULSES = "tolerance: eta / least eigenvalue"
STEPS = (1, 2, 4, 8)  # times as many as in the scene: of an order
ALLOWED = 1e-6  # gain over the largest energy so far: the bound that the project states
PASSES = re.compile(r"nscdd: step (\d+): .* pass into or through each other")


def dot(a, b):
    """In one order on every machine. BLAS, by which NumPy makes matrix products, chooses one for the processor."""
    return float((a * b).sum())


def norm(vector):
    return math.sqrt(dot(vector, vector))


def slip_ratio(case):
    """W_t / W_n of a contact with a wall: 7/2 for a sphere, 3 for a disk."""
    return 1 + 1 / case.inertia_share


def network(case, result, tangential):
    return theory.of_state(result, case.m, case.inertia_share * case.m * case.radii**2, result.json["wall_masses"], tangential)


def rest_bound(case, result):
    """On the speed of a grain that should be at rest: energy of the error over the lightest mass."""
    net = network(case, result, True)
    return net.velocity_bound(case.tolerance, net.impulses) / math.sqrt(case.m.min())


def slip(case, result):
    """Velocity of the lowest point of the first grain along x."""
    turn = result.spin[0, 0] if case.dimension == 2 else -result.spin[0, 1]
    return float(result.velocity[0, 0] + case.radii[0] * turn)


def overlap(case, result):
    """Overlaps add up to no more than the penetrations that the steps accepted."""
    most = math.fsum(result.json["penetration"])
    return case.row("largest overlap / R", most, result.json["final"]["max_overlap"], ROUND_OFF, "law: what the steps were allowed", result, relation="<=")


def column(case):
    """Contact k carries the weight above it, times h. [METHOD.md 2.1: V = 0, statics]"""
    result, chain = case.run(), theory.chain(case.m, supported=True)
    exact = np.cumsum(case.m[::-1])[::-1] * case.g * case.h
    found, owners = np.zeros(len(case.m)), [0] * len(case.m)
    for i, j, impulse, owner in zip(result.i, result.j, result.impulse, result.owner):
        k = 0 if j < 0 else max(i, j)
        found[k], owners[k] = norm(impulse), owner
    bound, error = chain.impulse_bound(case.tolerance) + ROUND_OFF, chain.norm(found - exact) / chain.norm(exact)
    yield case.row("impulse on the floor; error: of all impulses, in the norm of D", exact[0], found[0], bound, IMPULSES, result, error=error)
    if case.gauss_seidel:
        most = theory.most_iterations(theory.iteration_rate(case.m, owners), case.tolerance, case.scene["solver"]["check_every"])
        yield case.row("sweeps from zero impulses", most, result.json["iterations"][0], 0, "law: spectral radius of the iteration", result, relation="<=")


def crystal_square(case):
    """Every column of the lattice for itself; sideways nothing pushes."""
    result = case.run()
    height, size = result.x[:, -1], 2 * case.radii[0]
    layers = round(height.max() - height.min() + 1)
    chain = theory.chain([case.m[0]] * layers, supported=True)
    worst = total = 0.0
    for i, j, impulse in zip(result.i, result.j, result.impulse):
        below = -1 if j < 0 else min(height[i], height[j]) // size
        sideways = j >= 0 and abs(height[i] - height[j]) < 0.5 * size
        expected = 0 if sideways else (layers - 1 - below) * case.m[0] * case.g * case.h
        worst += chain.diagonal[-1] * (norm(impulse) - expected) ** 2
        total += chain.diagonal[-1] * expected**2
    floor, bound = result.on_wall(0), chain.impulse_bound(case.tolerance) + ROUND_OFF
    exact, error = case.m.sum() * case.g * case.h, math.sqrt(worst / total)
    yield case.row("impulses on the floor; error: of all impulses, in the norm of D", exact, floor, bound, IMPULSES, result, error=error)


def crystal_close(case):
    """At rest, so that the floor carries the whole weight, whatever way the forces take."""
    result = case.run()
    net = network(case, result, False)
    bound = 2 * math.sqrt(case.m.sum()) * net.velocity_bound(case.tolerance, net.impulses)
    floor = sum(r[-1] for r, j in zip(result.impulse, result.j) if j == -1)
    yield case.row("impulses on the floor", case.m.sum() * case.g * case.h, floor, bound, "tolerance: momentum of two steps", result)
    found = result.json["final"]["max_overlap"]
    yield case.row("largest overlap / R", 0, found, sum(result.json["penetration"]) + ROUND_OFF, "law: what the steps were allowed", result, relation="<=")


def restitution(case):
    """Newton: the relative velocity v becomes -e v."""
    e = case.law("grain", "heavy").get("restitution", 0)
    before = case.of_grains("velocity")[:, 0]
    after = (result := case.run()).velocity[:, 0]
    approach, momentum = before[0] - before[1], dot(case.m, before)
    yield case.row("relative velocity after", -e * approach, after[0] - after[1], ROUND_OFF * abs(approach), "round-off: one contact", result)
    yield case.row("momentum after", momentum, dot(case.m, after), ROUND_OFF * abs(momentum), "round-off", result)


def cradle(case):
    """All contacts at once: v_first = 1 - (1+e)(N-1)/N, all others (1+e)/N."""
    result, n, e = case.run(), len(case.m), case.law("grain", "grain").get("restitution", 0)
    exact = np.full(n, (1 + e) / n)
    exact[0] = 1 - (1 + e) * (n - 1) / n
    impulses = case.m[0] * (1 + e) * (1 - np.arange(1, n) / n)
    bound = theory.chain(case.m, supported=False).velocity_bound(case.tolerance, impulses) / math.sqrt(case.m[0]) + ROUND_OFF
    error = float(np.abs(result.velocity[:, 0] - exact).max())
    yield case.row("velocity of the first; error: the largest of all", exact[0], result.velocity[0, 0], bound, REST, result, error=error)


def oblique(case):
    """Sticks iff |u_t| <= ratio mu (1+e) |u_n|; else the tangential impulse is mu (1+e) m |u_n|."""
    result, pair, start, ratio = case.run(), case.law("grain", "wall"), case.scene["grain"][0], slip_ratio(case)
    e, source = pair.get("restitution", 0), "round-off: one contact"
    rate = start["spin"] * -1 if case.dimension == 2 else start["spin"][1]
    down, along = -start["velocity"][-1], start["velocity"][0] - start["radius"] * rate
    limit, bound = pair["friction"] * (1 + e) * down, 10 * ROUND_OFF * along
    yield case.row("normal velocity after", e * down, result.velocity[0, -1], bound, source, result)
    change = result.velocity[0, 0] - start["velocity"][0]
    yield case.row("change of tangential velocity", -min(along / ratio, limit), change, bound, source, result)
    yield case.row("slip after", max(0.0, along - ratio * limit), slip(case, result), bound, source, result)


def bounce(case):
    """At rest after sqrt(2 h0/g) (1+e)/(1-e)."""
    e, g, h = case.law("grain", "wall")["restitution"], case.g, case.h
    height = case.scene["grain"][0]["position"][-1] - case.radii[0]
    falls, speed = math.sqrt(2 * height / g), math.sqrt(2 * g * height)
    first = case.run(steps=int(falls / h) + 3)
    found = first.velocity[0, -1] + g * (first.json["steps"] * h - falls)
    yield case.row("rebound after the first impact", e * speed, found, 2 * (1 + e) * g * h, "O(h): seen up to h late, at a speed off by g h", first)
    result = case.run()
    free = [step for step, contacts in enumerate(result.json["contacts"], 1) if contacts == 0]
    # rebounds last until v ~ g h; each is seen up to h late, off by g h, which moves all later flights by 2 h / (1-e)
    rebounds = math.log(speed / (g * h)) / -math.log(e) + 1
    yield case.row("time until rest", falls * (1 + e) / (1 - e), h * free[-1], h * (rebounds + 1) * (1 + 2 / (1 - e)), "O(h): at every rebound", result)
    yield case.row("speed at the end", 0, abs(result.velocity[0, -1]), g * h, "O(h)", result)


def rolling(case):
    """Slip v0 - ratio mu g t until it is zero; friction and velocity are then constant: exact but in that one step."""
    mu, g, h, ratio, v0 = case.law("grain", "wall")["friction"], case.g, case.h, slip_ratio(case), case.of_grains("velocity")[0, 0]
    starts, bound = v0 / (ratio * mu * g), 1e3 * ROUND_OFF * v0
    steps = int(0.99 * starts / h)
    early, late, result = case.run(steps=steps), case.run(steps=int(1.01 * starts / h) + 1), case.run()
    yield case.row("slip 1 % before rolling", v0 - ratio * mu * g * steps * h, slip(case, early), bound, "round-off", early)
    yield case.row("slip 1 % after", 0, slip(case, late), bound, "round-off", late)
    rolls = v0 * (1 - 1 / ratio)
    yield case.row("velocity when rolling", rolls, result.velocity[0, 0], bound, "round-off", result)
    exact = v0 * starts - mu * g * starts**2 / 2 + rolls * (case.count * h - starts)
    yield case.row("place at the end", exact, result.x[0, 0], mu * g * h**2 + bound, "O(h^2): the step in which it begins", result)


def incline(case):
    """Rolls iff tan <= ratio mu, with 1 - 1/ratio of g sin; else it slides with g (sin - mu cos)."""
    result, mu, ratio = case.run(), case.law("grain", "wall")["friction"], slip_ratio(case)
    along, into = case.scene["gravity"][0], -case.scene["gravity"][-1]
    time, rolls = case.count * case.h, along <= ratio * mu * into
    bound = 1e3 * ROUND_OFF * along * time
    expected = (along * (1 - 1 / ratio) if rolls else along - mu * into) * time
    yield case.row("velocity", expected, result.velocity[0, 0], bound, "round-off: constant acceleration", result)
    yield case.row("slip", 0 if rolls else (along - ratio * mu * into) * time, slip(case, result), bound, "round-off", result)


def spin(case):
    """Kept when free, or about the normal (contact in a point); else I dw/dt = -2 mu F R until it is zero."""
    top, m, radius = case.scene["wall"][1], case.m[0], case.radii[0]
    pushed, rate = top.get("force", 0.0), case.of_grains("spin")[0]
    axis = int(np.abs(rate).argmax())
    start, slows = rate[axis], pushed > 0 and axis != 2
    fall = 2 * case.law("grain", "wall")["friction"] * pushed * radius / (case.inertia_share * m * radius**2)
    # the normal impulses, F h each, carry the error of the tolerance; they add up as friction over all steps
    press = theory.Network(np.array([[1.0, -1.0], [0.0, -1.0]]), np.array([1 / m, 1 / top.get("mass", 1.0)]))
    bound = (2 * press.impulse_bound(case.tolerance) * (pushed > 0) + ROUND_OFF) * abs(start)
    source = "tolerance: F h from step to step" if pushed else "round-off: nothing touches"
    for share, name in ((0.99, "spin, 1 % before it ends"), (1.01, "spin, 1 % after it ends")) if slows else ((None, "spin"),):
        steps = math.ceil(share * abs(start) / fall / case.h) if slows else case.count
        result = case.run(steps=steps)
        exact = math.copysign(max(0.0, abs(start) - (fall * steps * case.h if slows else 0.0)), start)
        yield case.row(name, exact, result.spin[0, axis], bound, source, result)


def pile(case):
    """k grains carry one, contacts tilted by a from the vertical: stands iff mu >= tan(a/2) between grains and
    tan(a/2)/(k+1) on the floor. Else it falls, at first with the acceleration below, then faster: by at least what that
    makes of the time, less the last step.

    Let s be the way of a base grain outwards, y = s tan a that of the top, N the normal force between them.
    Sliding between grains, rolling on the floor:   m (1+c) s'' = N (sin a - mu (1 + cos a)),
                                                    m y'' = m g - k N (cos a + mu sin a).
    Sliding on the floor, rolling between grains (a base turns by -1/cos a): power of all forces per s',
        m tan^2 a s'' + k m (1 + c/cos^2 a) s'' = m g tan a - mu (k m g + m g - m y'') (1 + 1/cos a).
    """
    k, g, c, h, radius, result = len(case.m) - 1, case.g, case.inertia_share, case.h, case.radii[-1], case.run()
    between, floor = case.law("grain", "grain")["friction"], case.law("grain", "wall")["friction"]
    a = math.pi / 6 if k == 2 else math.asin(1 / math.sqrt(3))
    sine, cosine, tangent = math.sin(a), math.cos(a), math.tan(a)
    fall = (case.scene["grain"][-1]["position"][-1] - result.x[-1, -1]) / radius
    if between >= math.tan(a / 2) and floor >= math.tan(a / 2) / (k + 1):
        bound = case.count * h * rest_bound(case, result) / radius + 1e-9
        yield case.row("fall of the top / R: stays", 0, fall, bound, EVERY_STEP, result)
        return
    if between < math.tan(a / 2):
        pull = (sine - between * (1 + cosine)) / (1 + c)  # s'' over N/m
        accelerates = tangent * pull * g / (k * (cosine + between * sine) + tangent * pull)
    else:
        lever = 1 + 1 / cosine
        accelerates = tangent * (g * tangent - floor * (k + 1) * g * lever) / (tangent**2 + k * (1 + c / cosine**2) - floor * tangent * lever)
    least = accelerates * ((case.count - 1) * h) ** 2 / 2 / radius
    yield case.row("fall of the top / R: falls, at least by", least, fall, 0, "law: acceleration at the start", result, relation=">=")


def wedge_squeezed(case):
    """Two forces in equilibrium lie on the chord, at beta to both normals: it holds iff mu >= tan beta. Else it slides
    out along the fixed side with u' = F q/(m + M q sin 2beta), q = (1 - mu^2) sin 2beta - 2 mu cos 2beta: friction mu N
    at both contacts, N1 = N2 (cos 2beta + mu sin 2beta), m u' = N2 q, and the driven side, of mass M, follows it."""
    result, mu, driven = case.run(), case.law("grain", "wall")["friction"], case.scene["wall"][1]
    opening = 2 * math.asin(-driven["normal"][-1])
    speed, bound = norm(result.velocity[0]), rest_bound(case, result)
    if mu >= math.tan(opening / 2):
        yield case.row("speed: holds", 0, speed, bound, REST, result)
        return
    q = (1 - mu**2) * math.sin(opening) - 2 * mu * math.cos(opening)
    exact = driven["force"] * q / (case.m[0] + driven["mass"] * q * math.sin(opening)) * case.count * case.h
    yield case.row("speed: squeezed out", exact, speed, case.count * bound + 1e3 * ROUND_OFF * exact, EVERY_STEP, result)


def wedge_locked(case):
    """Many answers: from zero impulses none is carried (r = 0 solves every step); from a prestress that mu allows,
    F cos beta along the chord, far above the weight, it stays."""
    falls, free = case.g * case.h * case.count, case.run()
    source = "round-off: no contact carries"
    yield case.row("speed from zero impulses: free fall", -falls, free.velocity[0, -1], ROUND_OFF * falls * case.count, source, free)
    result = case.run(start=case.sibling("wedge-squeezed-holds").run())
    yield case.row("speed from the prestress: stays", 0, norm(result.velocity[0]), rest_bound(case, result), REST, result)


def squeeze_fast(case):
    """Exit code 3, every step counted as unconverged, none longer than three attempts up to the cap: as it is found, without
    pairs that pass each other, and with those that then touch."""
    result, solver = case.run(exits=(3,)), case.scene["solver"]
    yield case.row("steps reported as unconverged", case.count, result.json["unconverged_steps"], 0, "law", result)
    cap = 3 * (solver["max_iterations"] + solver["check_every"])
    yield case.row("most iterations in a step", cap, max(result.json["iterations"]), 0, "law: the cap of each attempt", result, relation="<=")


def refused(*words):
    def family(case):
        result = case.run(exits=(1,))
        line = [text for text in result.errors.splitlines() if text.startswith("nscdd:") and not text.startswith("nscdd: note:")]
        found = sum(word in line[0] for word in words) if len(line) == 1 else 0
        yield case.row(f"refused in one line that says {', '.join(words)}", len(words), found, 0, "law", result)

    return family


def rest(case):
    result = case.run()
    for name, values in (("velocity", result.velocity), ("impulse", result.impulse)):
        yield case.row(f"largest {name}", 0, float(np.abs(values).max(initial=0)), 0, "law: nothing pushes", result)


def lid(case):
    """Impulses on the lid add up to F h, those on the floor to F h and the weights."""
    result, pushed, weights = case.run(), case.scene["wall"][1]["force"], case.m.sum() * case.g
    net, lid = network(case, result, False), result.json["wall_masses"][1]
    speed = net.velocity_bound(case.tolerance, net.impulses)
    for name, wall, exact, mass in (("lid", 1, pushed * case.h, lid), ("floor", 0, (pushed + weights) * case.h, case.m.sum() + lid)):
        bound = math.sqrt(mass) * speed + ROUND_OFF * exact
        yield case.row(f"impulses on the {name}", exact, result.on_wall(wall), bound, "tolerance: momentum left", result)


def potential(case, x):
    return -dot(case.m[:, None] * x, np.array(case.scene["gravity"]))


def energy(case, result):
    return result.json["final"]["kinetic_energy"] + potential(case, result.x)


def large_step(case):
    """Gaps are convex in the displacement, so overlaps add up; at theta = 1/2 contacts and friction only take energy."""
    result = case.run()
    start = potential(case, case.of_grains("position"))
    yield case.row("steps reported as unconverged", 0, result.json["unconverged_steps"], 0, "law", result)
    yield overlap(case, result)
    share, bound = (energy(case, result) - start) / start, case.tolerance * case.count
    yield case.row("energy gained / energy at the start", 0, share, bound, "tolerance: at every step", result, relation="<=")


def settled(case):
    """Settled first, at the default tolerance, and what still rolls or spins, which nothing stops, is stopped; once
    more, for a grain may have been stopped where it rolls on. From then on what moves, moves by the error of the
    velocities at every step."""
    before = case.at_rest(case.run(tolerance=1e-4))
    before = case.at_rest(case.run(start=before, tolerance=1e-4))
    result = case.run(start=before)
    bound, radius = case.count * case.h * rest_bound(case, result), case.radii[0]
    creep = float(np.linalg.norm(result.x - before.x, axis=1).max())
    yield case.row(f"creep in {case.count} steps / R", 0, creep / radius, bound / radius, EVERY_STEP, result)
    found = energy(case, result) - potential(case, before.x)
    yield case.row("energy gained", 0, found, case.m.sum() * case.g * bound, "tolerance: the weight times that creep", result, relation="<=")


def gas(case):
    """e = 1: v + v- = 0 wherever an impulse acts, so that no energy is lost, and none by the drift."""
    result = case.run()
    start = 0.5 * dot(case.m[:, None], np.square(case.of_grains("velocity")))
    yield case.row("energy", start, result.json["final"]["kinetic_energy"], case.count * case.tolerance * start, "tolerance: at every step", result)


def clump(case):
    """Contact impulses act at one point on both grains, which then drift along their velocities: nothing is exchanged
    with the outside, whatever the accuracy."""
    result, m = case.run(), case.m[:, None]
    x, v, spins = (case.of_grains(key) for key in ("position", "velocity", "spin"))
    inertia = (case.inertia_share * case.m * case.radii**2)[:, None]
    orbit = np.cross(x, m * v).reshape(len(m), -1)
    final = result.json["final"]
    for name, exact, found, scale in (
        ("momentum", (m * v).sum(0), final["momentum"], dot(case.m, np.linalg.norm(v, axis=1))),
        ("angular momentum", (orbit + inertia * spins).sum(0), final["angular_momentum"], np.abs(orbit).sum() + np.abs(inertia * spins).sum()),
    ):
        error, bound = norm(exact - found), ROUND_OFF * case.count * scale
        yield case.row(f"{name}, the last component; error: the whole", exact[-1], found[-1], bound, "round-off of every step", result, error=error)
    start = 0.5 * float((m * v**2).sum() + (inertia * spins**2).sum())
    yield case.row("energy at most", start, final["kinetic_energy"], case.tolerance * start, "tolerance", result, relation="<=")


def refined(case, theta, factor, impact=False):
    """The scene with `factor` times as many steps over the same time; `impact`: one more, so that what happens after two
    thirds of the time always happens two thirds into a step."""
    count = factor * (case.count - impact) + impact
    return case.with_step(h=case.h * case.count / count, count=count, theta=theta).run()


def order_rows(case, error_of, impact=False, exact_at_half=False):
    for theta in (0.5, 1.0):
        runs = [refined(case, theta, factor, impact) for factor in STEPS]
        errors = [error_of(run, theta) for run in runs]
        if exact_at_half and theta == 0.5:
            yield case.row("error of the place, theta = 1/2", 0, max(errors), 1e3 * ROUND_OFF, "round-off: constant acceleration", runs[-1])
            continue
        # the next order of the expansion changes the slope by less than the largest step's share of the time
        name, share, source = f"order of the place, theta = {theta:g}", 1 / case.count, "O(h): the next order over the first"
        order = -linear_regression([*map(math.log, STEPS)], [*map(math.log, errors)]).slope
        row = case.row(name, 1, order, 4 * share, source, runs[-1], relation=">=")
        yield row | {"series": [[run.json["h"], error] for run, error in zip(runs, errors)]}


def order_sliding(case):
    time = case.h * case.count
    place = case.of_grains("velocity")[0, 0] * time - case.law("grain", "wall")["friction"] * case.g * time**2 / 2
    yield from order_rows(case, lambda run, theta: abs(float(run.x[0, 0]) - place), exact_at_half=True)


def order_impact(case):
    e, g, radius = case.law("grain", "wall")["restitution"], case.g, case.radii[0]
    height = case.scene["grain"][0]["position"][-1] - radius
    after = case.h * case.count - math.sqrt(2 * height / g)
    place = radius + e * math.sqrt(2 * g * height) * after - g * after**2 / 2
    yield from order_rows(case, lambda run, theta: abs(float(run.x[0, -1]) - place), impact=True)


def order_packing(case):
    reference = {theta: refined(case, theta, 8 * STEPS[-1]) for theta in (0.5, 1.0)}
    yield from order_rows(case, lambda run, theta: norm(run.x - reference[theta].x))


def long_run(case, may_be_refused=False):
    """All steps, converged or not, and the exit code. `may_be_refused`: when a grain becomes too fast for the step, which the
    program says, the steps before."""
    count = case.count // (10 if case.quick else 1)
    result = case.run(steps=count, exits=(0, 1, 3) if may_be_refused else (0, 3))
    if result.exit != 1:
        return result, result.exit
    refused = PASSES.search(result.errors)
    return case.run(steps=int(refused[1]) - 1 if refused else count, exits=(0, 3)), 1


def balance(case, result):
    """The largest gain of energy, beyond what gravity and walls put in, and the largest rise of the work of contacts, each
    over the largest energy until then. Heights are measured from where each grain would lie on the floor, z = 0."""
    e = {key: np.array(values, float) for key, values in result.json["energy"].items()}
    start = e["before"][0] + case.g * dot(case.m, case.of_grains("position")[:, -1] - case.radii)
    gain = e["kinetic"] - e["before"][0] - np.cumsum(e["external"] + e["walls"])
    energy = start + gain + np.cumsum(e["walls"])
    largest = np.maximum.accumulate(np.maximum(start, energy))
    work = np.concatenate([[0.0], np.cumsum(e["normal"] + e["friction"])])
    rise = work - np.minimum.accumulate(work)
    return max(0.0, float((gain / largest).max())), float((rise[1:] / largest).max())


def gained(case, result, code):
    """Contacts only take energy: without friction for every e <= 1, with friction for e = 0. The rise of their work is told
    and not judged: where weight was not carried in one step, it is lifted in a later one."""
    (gain, rise), name = balance(case, result), "largest gain of energy / largest energy so far"
    row = case.row(name, 0, gain, ALLOWED, "law: contacts only take; the bound is stated", result, relation="<=")
    return row | {"exit": code, "rise": rise}


def stays(case):
    """Both at rest. A converged step leaves each of the two contacts a normal velocity of at most the velocity error times
    the mean change of velocity, which is g h but for such errors; one that did not converge what its penetration says."""
    result, code = long_run(case)
    yield gained(case, result, code)
    radius = case.radii.min()
    each = 1.1 * result.json["max_velocity_error"] * case.g * case.h
    penetration = np.array(result.json["penetration"]) * radius
    sinks = float(np.minimum(penetration, case.h * each).sum() if code == 0 else penetration.sum())
    source = "law: the velocity error of its two contacts" if code == 0 else "law: what the steps were allowed"
    found = case.scene["grain"][-1]["position"][-1] - result.x[-1, -1]
    yield case.row("the upper sinks / least R", 0, found / radius, 2 * sinks / radius + ROUND_OFF, source, result, relation="<=")
    if code == 0:
        yield case.row("largest velocity at the end", 0, float(np.abs(result.velocity).max()), 2 * each, source, result)


def heap(case):
    """One ball on one stays; on sixteen it may push them apart, and then no place is known but that overlaps keep to what
    the steps allowed."""
    if len(case.m) == 2:
        yield from stays(case)
        return
    result, code = long_run(case)
    yield gained(case, result, code)
    yield overlap(case, result)


def rebound(case):
    """A light ball between a heavy one and the floor, e near 1, carries it by ever faster rebounds in an ever smaller gap."""
    yield gained(case, *long_run(case, may_be_refused=True))


# By the beginning of the case's name, the longest that fits.
FAMILIES = {
    **{"column": column, "mass": column, "radius": column, "crystal-square": crystal_square, "crystal-close": crystal_close, "restitution": restitution},
    **{"cradle": cradle, "oblique": oblique, "bounce": bounce, "rolling": rolling, "incline": incline, "spin": spin, "pile": pile},
    **{"wedge-squeezed": wedge_squeezed, "wedge-locked": wedge_locked, "squeeze-fast": squeeze_fast, "squeeze-slow": refused("grain", "overlap", "%")},
    **{"coincident": refused("grain 0", "grain 1", "overlap"), "rest": rest, "lid": lid, "large-step": large_step, "settled": settled},
    **{"order-sliding": order_sliding, "order-impact": order_impact, "order-packing": order_packing, "gas": gas, "clump": clump},
    **{"pair": stays, "heap": heap, "rebound": rebound},
}
