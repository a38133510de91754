"""The exact answers of the scenes of cases/hard, with bounds on the error that come from theory, family by family.

A family is a function of a case (case.py) that makes the runs it needs and yields rows. Everything is taken
from the scene: masses, friction, gravity; no found figure is written down here. A row says where its bound comes from:

    tolerance    an answer of residual eta is that near to the exact one (theory.py)
    O(h)         the step
    round-off    the answer is exact but for the arithmetic
    law          an inequality that must hold whatever the accuracy
"""
import math

import numpy as np

from . import theory

ROUND_OFF = 1e-12  # relative, of sums of some thousand terms


# --- what the scenes say -----------------------------------------------------------------------------------------


def materials(scene):
    return {entry["name"]: entry["density"] for entry in scene["material"]}


def masses(scene):
    density, ball = materials(scene), scene["dimension"] == 3
    return np.array([density[g["material"]] * math.pi * g["radius"] ** 2 * (4 / 3 * g["radius"] if ball else 1) for g in scene["grain"]])


def radii(scene):
    return np.array([g["radius"] for g in scene["grain"]])


def inertia_share(scene):
    """I / (m R^2)."""
    return 0.4 if scene["dimension"] == 3 else 0.5


def slip_ratio(scene):
    """W_t / W_n of a contact with a wall: 7/2 for a sphere, 3 for a disk."""
    return 1 + 1 / inertia_share(scene)


def law(scene, *names):
    return next(entry for entry in scene["pair"] if sorted(entry["materials"]) == sorted(names))


def gravity(scene):
    return float(np.linalg.norm(scene["gravity"]))


def steps_until(scene, time):
    return int(time / scene["step"]["h"])


def network(scene, result, tangential):
    m = masses(scene)
    return theory.of_state(result, m, inertia_share(scene) * m * radii(scene) ** 2, result.json["wall_masses"], tangential)


def slip(scene, result, k=0):
    """Velocity of the lowest point of grain k along x."""
    rate = result.spin[k]
    turn = rate[0] if scene["dimension"] == 2 else -rate[1]
    return float(result.velocity[k, 0] + scene["grain"][k]["radius"] * turn)


# --- static stacks: impulses and sweeps --------------------------------------------------------------------------


def column(case):
    """Contact k carries the weight above it, times h. [METHOD.md 2.1: V = 0, statics]"""
    scene, result = case.scene, case.run()
    m, h, tolerance = masses(scene), scene["step"]["h"], scene["solver"]["tolerance"]
    exact = np.cumsum(m[::-1])[::-1] * gravity(scene) * h
    found = np.zeros(len(m))
    owners = [0] * len(m)
    for i, j, impulse, owner in zip(result.i, result.j, result.impulse, result.owner):
        found[0 if j < 0 else max(i, j)] = np.linalg.norm(impulse)
        owners[0 if j < 0 else max(i, j)] = owner
    chain = theory.chain(m, supported=True)
    bound, error = chain.impulse_bound(tolerance) + ROUND_OFF, chain.norm(found - exact) / chain.norm(exact)
    yield case.row(
        "impulse on the floor; error: of all impulses, in the norm of D", exact[0], found[0], bound, "tolerance: eta / least eigenvalue", result, error=error
    )
    if case.gauss_seidel:
        rate = theory.iteration_rate(m, owners)
        expected = theory.most_iterations(rate, tolerance, scene["solver"]["check_every"])
        yield case.row("sweeps from zero impulses", expected, result.json["iterations"][0], 0, "law: spectral radius of the iteration", result, relation="<=")


def crystal_square(case):
    """Every column of the lattice for itself; sideways nothing pushes."""
    scene, result = case.scene, case.run()
    m, h, height = masses(scene), scene["step"]["h"], result.x[:, -1]
    size, layers = 2 * scene["grain"][0]["radius"], round(height.max() - height.min() + 1)
    chain = theory.chain([m[0]] * layers, supported=True)
    worst = total = 0.0
    for i, j, impulse in zip(result.i, result.j, result.impulse):
        below = -1 if j < 0 else min(height[i], height[j]) // size
        sideways = j >= 0 and abs(height[i] - height[j]) < 0.5 * size
        expected = 0 if sideways else (layers - 1 - below) * m[0] * gravity(scene) * h
        worst += chain.diagonal[-1] * (np.linalg.norm(impulse) - expected) ** 2
        total += chain.diagonal[-1] * expected**2
    floor = sum(np.linalg.norm(r) for r, j in zip(result.impulse, result.j) if j < 0)
    exact = m.sum() * gravity(scene) * h
    bound = chain.impulse_bound(scene["solver"]["tolerance"]) + ROUND_OFF
    source = "tolerance: eta / least eigenvalue"
    yield case.row("impulses on the floor; error: of all impulses, in the norm of D", exact, floor, bound, source, result, error=math.sqrt(worst / total))


def crystal_close(case):
    """At rest, so that the floor carries the whole weight, whatever way the forces take."""
    scene, result = case.scene, case.run()
    m, h = masses(scene), scene["step"]["h"]
    bound = network(scene, result, False)
    speed = bound.velocity_bound(scene["solver"]["tolerance"], bound.impulses)
    floor = sum(r[-1] for r, j in zip(result.impulse, result.j) if j == -1)
    yield case.row("impulses on the floor", m.sum() * gravity(scene) * h, floor, 2 * math.sqrt(m.sum()) * speed, "tolerance: momentum of two steps", result)
    found = result.json["final"]["max_overlap"]
    yield case.row("largest overlap / R", 0, found, sum(result.json["penetration"]) + ROUND_OFF, "law: what the steps were allowed", result, relation="<=")


# --- impacts -----------------------------------------------------------------------------------------------------


def restitution(case):
    """Newton: the relative velocity v becomes -e v."""
    scene = case.scene
    e = law(scene, "grain", "heavy").get("restitution", 0)
    before = [g["velocity"][0] for g in scene["grain"]]
    after = (result := case.run()).velocity[:, 0]
    approach = before[0] - before[1]
    yield case.row("relative velocity after", -e * approach, after[0] - after[1], ROUND_OFF * abs(approach), "round-off: one contact", result)
    momentum = masses(scene) @ before
    yield case.row("momentum after", momentum, masses(scene) @ after, ROUND_OFF * abs(momentum), "round-off", result)


def cradle(case):
    """All contacts at once: v_first = 1 - (1+e)(N-1)/N, all others (1+e)/N."""
    scene, result = case.scene, case.run()
    n, e = len(scene["grain"]), law(scene, "grain", "grain").get("restitution", 0)
    exact = np.full(n, (1 + e) / n)
    exact[0] = 1 - (1 + e) * (n - 1) / n
    m = masses(scene)
    impulses = m[0] * (1 + e) * (1 - np.arange(1, n) / n)
    bound = theory.chain(m, supported=False).velocity_bound(scene["solver"]["tolerance"], impulses) / math.sqrt(m[0])
    source, error = "tolerance: energy of the error", float(np.abs(result.velocity[:, 0] - exact).max())
    yield case.row("velocity of the first; error: the largest of all", exact[0], result.velocity[0, 0], bound + ROUND_OFF, source, result, error=error)


def oblique(case):
    """Sticks iff |u_t| <= ratio mu (1+e) |u_n|; else the tangential impulse is mu (1+e) m |u_n|."""
    scene, result = case.scene, case.run()
    pair, start = law(scene, "grain", "wall"), scene["grain"][0]
    e, mu, ratio = pair.get("restitution", 0), pair["friction"], slip_ratio(scene)
    rate = start["spin"] * -1 if scene["dimension"] == 2 else start["spin"][1]
    down, along = -start["velocity"][-1], start["velocity"][0] - start["radius"] * rate
    limit = mu * (1 + e) * down
    bound = 10 * ROUND_OFF * along
    yield case.row("normal velocity after", e * down, result.velocity[0, -1], bound, "round-off: one contact", result)
    expected = -min(along / ratio, limit)
    yield case.row("change of tangential velocity", expected, result.velocity[0, 0] - start["velocity"][0], bound, "round-off: one contact", result)
    yield case.row("slip after", max(0.0, along - ratio * limit), slip(scene, result), bound, "round-off: one contact", result)


def bounce(case):
    """At rest after sqrt(2 h0/g) (1+e)/(1-e)."""
    scene = case.scene
    e, g, h = law(scene, "grain", "wall")["restitution"], gravity(scene), scene["step"]["h"]
    height = scene["grain"][0]["position"][-1] - scene["grain"][0]["radius"]
    falls, speed = math.sqrt(2 * height / g), math.sqrt(2 * g * height)
    first = case.run(steps=steps_until(scene, falls) + 3)
    elapsed = first.json["steps"] * h - falls
    found = first.velocity[0, -1] + g * elapsed
    yield case.row("rebound after the first impact", e * speed, found, 2 * (1 + e) * g * h, "O(h): seen up to h late, at a speed off by g h", first)
    result = case.run()
    free = [step for step, contacts in enumerate(result.json["contacts"], 1) if contacts == 0]
    # rebounds last until v ~ g h; each is seen up to h late, off by g h, which moves all later flights by 2 h / (1-e)
    rebounds = math.log(speed / (g * h)) / -math.log(e) + 1
    yield case.row("time until rest", falls * (1 + e) / (1 - e), h * free[-1], h * (rebounds + 1) * (1 + 2 / (1 - e)), "O(h): at every rebound", result)
    yield case.row("speed at the end", 0, abs(result.velocity[0, -1]), g * h, "O(h)", result)


# --- rolling and spinning ----------------------------------------------------------------------------------------


def rolling(case):
    """Slip v0 - ratio mu g t until it is zero; friction and velocity are then constant: exact but in that one step."""
    scene = case.scene
    mu, g, h, ratio = law(scene, "grain", "wall")["friction"], gravity(scene), scene["step"]["h"], slip_ratio(scene)
    v0 = scene["grain"][0]["velocity"][0]
    starts = v0 / (ratio * mu * g)
    steps = steps_until(scene, 0.99 * starts)
    early = case.run(steps=steps)
    tolerance = 1e3 * ROUND_OFF * v0
    yield case.row("slip 1 % before rolling", v0 - ratio * mu * g * steps * h, slip(scene, early), tolerance, "round-off", early)
    late = case.run(steps=steps_until(scene, 1.01 * starts) + 1)
    yield case.row("slip 1 % after", 0, slip(scene, late), tolerance, "round-off", late)
    result = case.run()
    rolls = v0 * (1 - 1 / ratio)
    yield case.row("velocity when rolling", rolls, result.velocity[0, 0], tolerance, "round-off", result)
    exact = v0 * starts - mu * g * starts**2 / 2 + rolls * (scene["step"]["count"] * h - starts)
    yield case.row("place at the end", exact, result.x[0, 0], mu * g * h**2 + tolerance, "O(h^2): the step in which it begins", result)


def incline(case):
    """Rolls iff tan <= ratio mu, with 1 - 1/ratio of g sin; else it slides with g (sin - mu cos)."""
    scene, result = case.scene, case.run()
    mu, ratio = law(scene, "grain", "wall")["friction"], slip_ratio(scene)
    along, into = scene["gravity"][0], -scene["gravity"][-1]
    time = scene["step"]["count"] * scene["step"]["h"]
    rolls = along <= ratio * mu * into
    bound = 1e3 * ROUND_OFF * along * time
    expected = (along * (1 - 1 / ratio) if rolls else along - mu * into) * time
    yield case.row("velocity", expected, result.velocity[0, 0], bound, "round-off: constant acceleration", result)
    yield case.row("slip", 0 if rolls else (along - ratio * mu * into) * time, slip(scene, result), bound, "round-off", result)


def spin(case):
    """Kept when free, or about the normal (contact in a point); else I dw/dt = -2 mu F R until it is zero."""
    scene = case.scene
    pushed = scene["wall"][1].get("force", 0.0)
    rate = scene["grain"][0]["spin"]
    axis = 2 if scene["dimension"] == 3 and rate[2] else 1 if scene["dimension"] == 3 else 0
    start = rate[axis] if scene["dimension"] == 3 else rate
    h, mu = scene["step"]["h"], law(scene, "grain", "wall")["friction"]
    radius, tolerance = scene["grain"][0]["radius"], scene["solver"]["tolerance"]
    slows = pushed > 0 and axis != 2
    inertia = inertia_share(scene) * masses(scene)[0] * radius**2
    fall = 2 * mu * pushed * radius / inertia
    # the normal impulses, F h each, carry the error of the tolerance; they add up as friction over all steps
    m = masses(scene)[0]
    press = theory.Network(np.array([[1.0, -1.0], [0.0, -1.0]]), np.array([1 / m, 1 / scene["wall"][1].get("mass", 1.0)]))
    loose = (2 * press.impulse_bound(tolerance) * (pushed > 0) + ROUND_OFF) * abs(start)
    for share in (0.99, 1.01) if slows else (None,):
        steps = math.ceil(share * abs(start) / fall / h) if slows else scene["step"]["count"]
        result = case.run(steps=steps)
        exact = math.copysign(max(0.0, abs(start) - (fall * steps * h if slows else 0.0)), start)
        name = f"spin, 1 % {'before' if share < 1 else 'after'} it ends" if slows else "spin"
        yield case.row(name, exact, result.spin[0, axis], loose, "tolerance: F h from step to step" if pushed else "round-off: nothing touches", result)


# --- thresholds --------------------------------------------------------------------------------------------------


def rest_bound(scene, result):
    """On the speed of a grain that should be at rest: energy of the error over the lightest mass."""
    net = network(scene, result, True)
    return net.velocity_bound(scene["solver"]["tolerance"], net.impulses) / math.sqrt(masses(scene).min())


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
    scene = case.scene
    k, g, c = len(scene["grain"]) - 1, gravity(scene), inertia_share(scene)
    between, floor = law(scene, "grain", "grain")["friction"], law(scene, "grain", "wall")["friction"]
    a = math.pi / 6 if k == 2 else math.asin(1 / math.sqrt(3))
    sine, cosine, tangent = math.sin(a), math.cos(a), math.tan(a)
    h, count = scene["step"]["h"], scene["step"]["count"]
    radius, result = scene["grain"][-1]["radius"], case.run()
    fall = (scene["grain"][-1]["position"][-1] - result.x[-1, -1]) / radius
    if between >= math.tan(a / 2) and floor >= math.tan(a / 2) / (k + 1):
        bound = count * h * rest_bound(scene, result) / radius + 1e-9
        yield case.row("fall of the top / R: stays", 0, fall, bound, "tolerance: energy of the error at every step", result)
        return
    if between < math.tan(a / 2):
        pull = (sine - between * (1 + cosine)) / (1 + c)  # s'' over N/m
        accelerates = tangent * pull * g / (k * (cosine + between * sine) + tangent * pull)
    else:
        lever = 1 + 1 / cosine
        accelerates = tangent * (g * tangent - floor * (k + 1) * g * lever) / (tangent**2 + k * (1 + c / cosine**2) - floor * tangent * lever)
    least = accelerates * ((count - 1) * h) ** 2 / 2 / radius
    yield case.row("fall of the top / R: falls, at least by", least, fall, 0, "law: acceleration at the start", result, relation=">=")


def wedge_squeezed(case):
    """Two forces in equilibrium lie on the chord, at beta to both normals: it holds iff mu >= tan beta. Else it slides
    out along the fixed side with u' = F q/(m + M q sin 2beta), q = (1 - mu^2) sin 2beta - 2 mu cos 2beta: friction mu N
    at both contacts, N1 = N2 (cos 2beta + mu sin 2beta), m u' = N2 q, and the driven side, of mass M, follows it."""
    scene, result = case.scene, case.run()
    mu, m, driven = law(scene, "grain", "wall")["friction"], masses(scene)[0], scene["wall"][1]
    opening = 2 * math.asin(-driven["normal"][-1])
    time = scene["step"]["count"] * scene["step"]["h"]
    speed = float(np.linalg.norm(result.velocity[0]))
    bound = rest_bound(scene, result)
    if mu >= math.tan(opening / 2):
        yield case.row("speed: holds", 0, speed, bound, "tolerance: energy of the error", result)
        return
    q = (1 - mu**2) * math.sin(opening) - 2 * mu * math.cos(opening)
    exact = driven["force"] * q / (m + driven["mass"] * q * math.sin(opening)) * time
    allowed = scene["step"]["count"] * bound + 1e3 * ROUND_OFF * exact
    yield case.row("speed: squeezed out", exact, speed, allowed, "tolerance: energy of the error at every step", result)


def wedge_locked(case):
    """Many answers: from zero impulses none is carried (r = 0 solves every step); from a prestress that mu allows,
    F cos beta along the chord, far above the weight, it stays."""
    scene = case.scene
    g, h, count = gravity(scene), scene["step"]["h"], scene["step"]["count"]
    free = case.run()
    found = free.velocity[0, -1]
    yield case.row("speed from zero impulses: free fall", -g * h * count, found, ROUND_OFF * g * h * count * count, "round-off: no contact carries", free)
    squeezed = case.sibling("wedge-squeezed-holds").run()
    result = case.run(start=squeezed)
    found = float(np.linalg.norm(result.velocity[0]))
    yield case.row("speed from the prestress: stays", 0, found, rest_bound(scene, result), "tolerance: energy of the error", result)


# --- no answer ---------------------------------------------------------------------------------------------------


def squeeze_fast(case):
    """Exit code 3, every step counted as unconverged, none longer than three attempts up to the cap: as it is found, without
    pairs that pass each other, and with those that then touch."""
    scene, result = case.scene, case.run(exits=(3,))
    yield case.row("steps reported as unconverged", scene["step"]["count"], result.json["unconverged_steps"], 0, "law", result)
    cap = 3 * (scene["solver"]["max_iterations"] + scene["solver"]["check_every"])
    yield case.row("most iterations in a step", cap, max(result.json["iterations"]), 0, "law: the cap of each attempt", result, relation="<=")


def refused(words):
    def family(case):
        result = case.run(exits=(1,))
        line = [text for text in result.errors.splitlines() if text.startswith("nscdd:") and not text.startswith("nscdd: note:")]
        found = sum(word in line[0] for word in words) if len(line) == 1 else 0
        yield case.row(f"refused in one line that says {', '.join(words)}", len(words), found, 0, "law", result)

    return family


# --- rest, walls, long runs --------------------------------------------------------------------------------------


def rest(case):
    result = case.run()
    yield case.row("largest velocity", 0, float(np.abs(result.velocity).max()), 0, "law: nothing pushes", result)
    yield case.row("largest impulse", 0, float(np.abs(result.impulse).max(initial=0)), 0, "law: nothing pushes", result)


def lid(case):
    """Impulses on the lid add up to F h, those on the floor to F h and the weights."""
    scene, result = case.scene, case.run()
    h, pushed = scene["step"]["h"], scene["wall"][1]["force"]
    net = network(scene, result, False)
    speed = net.velocity_bound(scene["solver"]["tolerance"], net.impulses)
    m = masses(scene)
    for name, wall, exact, mass in (
        ("lid", -2, pushed * h, result.json["wall_masses"][1]),
        ("floor", -1, (pushed + m.sum() * gravity(scene)) * h, m.sum() + result.json["wall_masses"][1]),
    ):
        found = sum(np.linalg.norm(r) for r, j in zip(result.impulse, result.j) if j == wall)
        yield case.row(f"impulses on the {name}", exact, found, math.sqrt(mass) * speed + ROUND_OFF * exact, "tolerance: momentum left", result)


def energy(scene, result):
    m = masses(scene)
    return result.json["final"]["kinetic_energy"] - float(m @ (result.x @ np.array(scene["gravity"])))


def large_step(case):
    """Gaps are convex in the displacement, so overlaps add up to no more than the penetrations that the steps accepted;
    at theta = 1/2 contacts and friction only take energy."""
    scene, result = case.scene, case.run()
    start = -float(masses(scene) @ (np.array([g["position"] for g in scene["grain"]]) @ np.array(scene["gravity"])))
    yield case.row("steps reported as unconverged", 0, result.json["unconverged_steps"], 0, "law", result)
    expected = sum(result.json["penetration"])
    yield case.row("largest overlap / R", expected, result.json["final"]["max_overlap"], ROUND_OFF, "law: what the steps were allowed", result, relation="<=")
    bound = scene["solver"]["tolerance"] * scene["step"]["count"]
    yield case.row("energy gained / energy at the start", 0, (energy(scene, result) - start) / start, bound, "tolerance: at every step", result, relation="<=")


def settled(case):
    """Settled first, at the default tolerance, and what still rolls or spins, which nothing stops, is stopped; once
    more, for a grain may have been stopped where it rolls on. From then on what moves, moves by the error of the
    velocities at every step."""
    scene = case.scene
    count, h, radius = scene["step"]["count"], scene["step"]["h"], scene["grain"][0]["radius"]
    before = case.at_rest(case.run(tolerance=1e-4))
    before = case.at_rest(case.run(start=before, tolerance=1e-4))
    result = case.run(start=before)
    bound = count * h * rest_bound(scene, result)
    creep = float(np.linalg.norm(result.x - before.x, axis=1).max())
    yield case.row(f"creep in {count} steps / R", 0, creep / radius, bound / radius, "tolerance: energy of the error at every step", result)
    found = energy(scene, result) + float(masses(scene) @ (before.x @ np.array(scene["gravity"])))
    yield case.row("energy gained", 0, found, masses(scene).sum() * gravity(scene) * bound, "tolerance: the weight times that creep", result, relation="<=")


# --- time stepping -----------------------------------------------------------------------------------------------

STEPS = (1, 2, 4, 8)  # times as many as in the scene


def observed_order(errors):
    """Slope of log(error) over log(h) by least squares."""
    return float(np.polyfit(-np.log(STEPS), np.log(errors), 1)[0])


def refined(case, theta, factor, impact=False):
    """The scene with `factor` times as many steps over the same time; `impact`: one more, so that what happens after two
    thirds of the time always happens two thirds into a step."""
    step = case.scene["step"]
    time = step["h"] * step["count"]
    count = factor * (step["count"] - impact) + impact
    return case.with_step(h=time / count, count=count, theta=theta).run()


def order_rows(case, error_of, impact=False, exact_at_half=False):
    for theta in (0.5, 1.0):
        runs = [refined(case, theta, factor, impact) for factor in STEPS]
        errors = [error_of(run, theta) for run in runs]
        if exact_at_half and theta == 0.5:
            yield case.row("error of the place, theta = 1/2", 0, max(errors), 1e3 * ROUND_OFF, "round-off: constant acceleration", runs[-1])
            continue
        # the next order of the expansion changes the slope by less than the largest step's share of the time
        share = 1 / case.scene["step"]["count"]
        row = case.row(
            f"order of the place, theta = {theta:g}", 1, observed_order(errors), 4 * share, "O(h): the next order over the first", runs[-1], relation=">="
        )
        yield row | {"series": [[run.json["h"], error] for run, error in zip(runs, errors)]}


def order_sliding(case):
    scene = case.scene
    mu, g, v0 = law(scene, "grain", "wall")["friction"], gravity(scene), scene["grain"][0]["velocity"][0]
    time = scene["step"]["h"] * scene["step"]["count"]
    place = v0 * time - mu * g * time**2 / 2
    yield from order_rows(case, lambda run, theta: abs(float(run.x[0, 0]) - place), exact_at_half=True)


def order_impact(case):
    scene = case.scene
    e, g = law(scene, "grain", "wall")["restitution"], gravity(scene)
    radius = scene["grain"][0]["radius"]
    height = scene["grain"][0]["position"][-1] - radius
    after = scene["step"]["h"] * scene["step"]["count"] - math.sqrt(2 * height / g)
    place = radius + e * math.sqrt(2 * g * height) * after - g * after**2 / 2
    yield from order_rows(case, lambda run, theta: abs(float(run.x[0, -1]) - place), impact=True)


def order_packing(case):
    reference = {theta: refined(case, theta, 8 * STEPS[-1]) for theta in (0.5, 1.0)}
    yield from order_rows(case, lambda run, theta: float(np.linalg.norm(run.x - reference[theta].x)))


def gas(case):
    """e = 1: v + v- = 0 wherever an impulse acts, so that no energy is lost, and none by the drift."""
    scene, result = case.scene, case.run()
    start = 0.5 * float(masses(scene) @ np.sum(np.square([g["velocity"] for g in scene["grain"]]), axis=1))
    count, tolerance = scene["step"]["count"], scene["solver"]["tolerance"]
    yield case.row("energy", start, result.json["final"]["kinetic_energy"], count * tolerance * start, "tolerance: at every step", result)


def clump(case):
    """Contact impulses act at one point on both grains, which then drift along their velocities: nothing is exchanged
    with the outside, whatever the accuracy."""
    scene, result = case.scene, case.run()
    m, dimension = masses(scene), scene["dimension"]
    v = np.array([g["velocity"] for g in scene["grain"]])
    x = np.array([g["position"] for g in scene["grain"]])
    spins = np.array([g["spin"] for g in scene["grain"]]).reshape(len(m), -1)
    inertia = (inertia_share(scene) * m * radii(scene) ** 2)[:, None]
    orbit = np.cross(x, m[:, None] * v).reshape(len(m), -1)
    angular = (orbit + inertia * spins).sum(0)
    final = result.json["final"]
    bound = ROUND_OFF * scene["step"]["count"]
    for name, exact, found, scale in (
        ("momentum", (m[:, None] * v).sum(0), final["momentum"], m @ np.linalg.norm(v, axis=1)),
        ("angular momentum", angular, final["angular_momentum"], np.abs(orbit).sum() + np.abs(inertia * spins).sum()),
    ):
        error = float(np.linalg.norm(exact - found))
        yield case.row(f"{name}, the last component; error: the whole", exact[-1], found[-1], bound * scale, "round-off of every step", result, error=error)
    start = 0.5 * float((m[:, None] * v**2).sum() + (inertia * spins**2).sum())
    yield case.row("energy at most", start, final["kinetic_energy"], scene["solver"]["tolerance"] * start, "tolerance", result, relation="<=")


# By the beginning of the case's name, the longest that fits.
FAMILIES = {
    "column": column,
    "mass": column,
    "radius": column,
    "crystal-square": crystal_square,
    "crystal-close": crystal_close,
    "restitution": restitution,
    "cradle": cradle,
    "oblique": oblique,
    "bounce": bounce,
    "rolling": rolling,
    "incline": incline,
    "spin": spin,
    "pile": pile,
    "wedge-squeezed": wedge_squeezed,
    "wedge-locked": wedge_locked,
    "squeeze-fast": squeeze_fast,
    "squeeze-slow": refused(("grain", "overlap", "%")),
    "coincident": refused(("grain 0", "grain 1", "overlap")),
    "rest": rest,
    "lid": lid,
    "large-step": large_step,
    "settled": settled,
    "order-sliding": order_sliding,
    "order-impact": order_impact,
    "order-packing": order_packing,
    "gas": gas,
    "clump": clump,
}
