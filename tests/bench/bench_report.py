"""The benchmark's figures as tables of Markdown, and docs/performance.md with a roofline."""

from pathlib import Path

#: million element updates per second at 10k, 100k, 1M elements: what must be reached and the goal, by threads
RATE_GOALS = {1: ((190, 153, 82), (225, 157, 113)), 2: ((265, 300, 140), (285, 310, 190))}
SIZES = {10_000: "10k", 100_000: "100k", 1_000_000: "1M"}


def table(heading, rows):
    """A table of Markdown."""
    lines = ["| " + " | ".join(heading) + " |", "|" + "---|" * len(heading)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows])


def rate(row):
    """Million element updates per second."""
    return row["elements"] / row["step"] / 1e6


def reached(value, must, goal, low_is_good=False):
    """How a figure stands to what must be reached and to the goal."""
    sign = -1 if low_is_good else 1
    if sign * value >= sign * goal:
        return "goal"
    return "yes" if sign * value >= sign * must else "**no**"


def bound(row, bandwidth, caches):
    """Million element updates per second that the bandwidth allows, and which one: what a step moves over the bandwidth
    of the fastest memory that holds it (second-level caches of all threads, third level, memory)."""
    working_set = row["bytes_per_step"]
    level = "L2" if working_set <= caches["L2"] * row["threads"] else "L3" if working_set <= caches["L3"] else "DRAM"
    return row["elements"] / (working_set / bandwidth[str(row["threads"])]["bandwidth_" + level]) / 1e6, level


def plain_steps(figures):
    """Steps along the Hilbert curve without contact."""
    return [row for row in figures.get("step", []) if row["ordering"] == "HILBERT" and not row["cracked"]]


def step_table(figures):
    """Rates against what must be reached, the goals, and the bound of the bandwidth."""
    rows = []
    for row in plain_steps(figures):
        place = list(SIZES).index(row["size"])
        must, goal = (limit[place] for limit in RATE_GOALS[row["threads"]])
        limit, level = bound(row, figures["bandwidth"], figures["machine"]["cache_bytes"])
        rows.append(
            [
                SIZES[row["size"]],
                row["threads"],
                f"{rate(row):.0f}",
                f"{row['elements'] / max(row.get('steps', [row['step']])) / 1e6:.0f}",
                must,
                goal,
                reached(rate(row), must, goal),
                f"{row['bytes_per_step'] / row['elements']:.0f}",
                f"{limit:.0f} ({level})",
                f"{100 * rate(row) / limit:.0f} %",
            ]
        )
    heading = [
        "elements",
        "threads",
        "million updates/s",
        "slowest process",
        "must",
        "goal",
        "reached",
        "bytes/update",
        "bound of the bandwidth",
        "of the bound",
    ]
    return table(heading, rows)


def ordering_table(figures):
    """Rates by internal numbering, one thread and two."""
    rows = []
    for size, threads in sorted({(row["size"], row["threads"]) for row in figures["step"]}):
        cells = {
            row["ordering"]: f"{rate(row):.0f}"
            for row in figures["step"]
            if row["size"] == size and row["threads"] == threads and not row["cracked"]
        }
        names = ("HILBERT", "METIS", "NONE", "SHUFFLED")
        rows.append([SIZES[size], threads, *[cells.get(name, "") for name in names]])
    return table(["elements", "threads", "HILBERT", "METIS", "NONE, row by row", "NONE, shuffled"], rows)


def contact_table(figures):
    """Steps with contact against elastic ones."""
    rows = []
    for cracked in (row for row in figures["step"] if row["cracked"] and "whole_step" in row):
        ratios = sorted(cracked.get("ratios", [cracked["step"] / cracked["whole_step"]]))
        ratio = ratios[len(ratios) // 2]
        share = 100 * cracked["contact_nodes"] / cracked["nodes"]
        rows.append(
            [
                SIZES[cracked["size"]],
                "crossing, in a corner" if cracked["cracked"] == "CROSSED" else "straight",
                cracked["threads"],
                f"{share:.1f} %",
                f"{rate(cracked):.0f}",
                f"{ratio:.2f}" + (f" ({ratios[0]:.2f} to {ratios[-1]:.2f})" if len(ratios) > 1 else ""),
                1.5,
                1.2,
            ]
            + [reached(ratio, 1.5, 1.2, low_is_good=True) if ratio > 0.97 else "noise"]
        )
    heading = ["elements", "cracks", "threads", "contact nodes", "million updates/s", "x elastic step"]
    return table([*heading, "must", "goal", "reached"], rows)


def look_table(figures):
    """Looks at the criterion in steps."""
    rows = []
    for row in figures["look"]:
        bending, uniform = row["look_bending"] / row["step"], row["look_uniform"] / row["step"]
        rows.append(
            [
                SIZES[row["size"]],
                row["threads"],
                f"{bending:.1f}",
                10,
                3,
                reached(bending, 10, 3, True),
                f"{uniform:.0f}",
            ]
        )
    return table(["elements", "threads", "steps a look", "must", "goal", "reached", "all nodes alike"], rows)


def event_table(figures):
    """Cost of an event."""
    rows = []
    for row in figures["event"]:
        topology, whole = row["item_topology"] * 1e6, row["whole"] * 1e6
        items = {name.removeprefix("item_"): value * 1e6 for name, value in row.items() if name.startswith("item_")}
        rows.append(
            [SIZES[row["size"]], "10 %" if row.get("cracked") else "none"]
            + [f"{topology:.0f}", reached(topology, 200, 50, True), f"{whole:.0f}"]
            + [reached(whole, 1000, 500, True)]
            + [f"{items[name]:.0f}" for name in ("rows", "contact", "pieces", "apply", "energy", "failure")]
            + [f"{1e3 * row['first']:.0f} ms"]
        )
    heading = ["elements", "contact nodes", "topology [us]", "reached", "whole event [us]", "reached"]
    heading += ["rows", "contact", "pieces", "loads", "energy", "failure", "first event"]
    return table(heading, rows) + "\n\nMust: topology 200 us, whole event 1,000 us; goal: 50 us and 500 us, flat."


def growth_table(figures):
    """What new numbers bring."""
    rows = [
        [
            SIZES[row["size"]],
            *[f"{row[name] / 1e6:.0f}" for name in ("updates", "updates_grown", "updates_renumbered")],
            f"{row['renumbering']:.2f} s",
        ]
        for row in figures["growth"]
    ]
    return table(["elements", "before", "grown by 5 %", "numbered anew", "numbering anew takes"], rows)


def memory_table(figures):
    """Memory per element."""
    figure = figures["memory"]
    rows = []
    for kind, name, must, goal in (("elastic", "elastic", 250, 160), ("all", "everything on", 600, 400)):
        value = figure[kind]["bytes_per_element"]
        rows.append([name, f"{value:.0f}", must, goal, reached(value, must, goal, True)])
    return table([f"{SIZES[figure['size']]} elements", "bytes/element", "must", "goal", "reached"], rows)


def files_table(figures):
    """Reading and writing."""
    figure = figures["files"]
    elements = f"{figure['elements']:,}"
    rows = [
        [f"deck of {elements} elements listed in it read, numbered", f"{figure['listed']['read']:.2f} s", "5 s"],
        ["the same mesh generated (*MESH), numbered", f"{figure['generated']['read']:.2f} s", "5 s"],
        [f"a frame of {elements} elements (compressed, double displacements)", f"{figure['frame']:.2f} s", "2 s"],
        ["largest memory of that run", f"{figure['listed']['peak_bytes_per_element']:.0f} bytes/element", ""],
    ]
    return table(["what", "measured", "must"], rows)


def runs_table(figures):
    """Whole runs with their profile."""
    names = []
    for row in figures["runs"]:
        names += [name for name in row.get("phases", {}) if name not in names]
    rows = []
    for row in figures["runs"]:
        if row.get("missing"):
            rows.append([f"{row['name']}, h = {row['h']}", row["threads"], "mesh not there"] + [""] * (4 + len(names)))
            continue
        rows.append(
            [
                f"{row['name']}, h = {row['h']}",
                row["threads"],
                f"{row['elements']:,}",
                row["events"],
                f"{row['iterations']:,}",
            ]
            + [f"{row['seconds']:.1f}", f"{row['updates_per_second'] / 1e6:.0f}"]
            + [f"{row['phases'].get(name, 0):.2f}" for name in names]
        )
    heading = ["run", "threads", "elements", "events", "iterations", "seconds", "million updates/s", *names]
    return table(heading, rows)


def direct_table(figures):
    """Equilibrium from rest."""
    rows = []
    for row in figures["direct"]:
        calculix = f"{row['calculix']:.2f}" if "calculix" in row else "not there"
        rows.append(
            [f"{row['elements']:,}", f"{row['relaxation']:.2f}", f"{row['iterations']:,}", f"{row['solve']:.2f}"]
            + [f"{row['assembly']:.2f}", calculix, f"{row['difference']:.1e}"]
        )
    heading = [
        "elements",
        "relaxation, 1 thread [s]",
        "iterations",
        "SuperLU: solve [s]",
        "assembly [s]",
        "CalculiX, whole run [s]",
    ]
    return table([*heading, "reactions differ by"], rows)


def peers_table(figures):
    """Akantu beside rfem, or why it is not."""
    figure = figures["peers"]
    if "missing" in figure:
        return f"Akantu: {figure['missing']}."
    rows = []
    for row in plain_steps(figures):
        if row["threads"] == 1 and str(row["size"]) in figure["akantu"]:
            other = figure["akantu"][str(row["size"])]
            rows.append(
                [SIZES[row["size"]], f"{rate(row):.0f}", f"{other / 1e6:.1f}", f"{rate(row) * 1e6 / other:.0f}"]
            )
    return table(["elements", "rfem, million updates/s", "Akantu, explicit lumped", "ratio"], rows)


SECTIONS = (
    ("step", "The relaxation step", step_table),
    ("step", "Numberings", ordering_table),
    ("step", "Contact", contact_table),
    ("look", "A look at the criterion", look_table),
    ("event", "A split event", event_table),
    ("growth", "Growth", growth_table),
    ("memory", "Memory", memory_table),
    ("files", "Files", files_table),
    ("runs", "Whole runs", runs_table),
    ("direct", "Equilibrium from rest", direct_table),
    ("peers", "Another program", peers_table),
)

NOTES = {
    "The relaxation step": """\
A complete step: internal forces, damped update, supports, and all sums that damping and the test of convergence
need. *Bytes an update* counts the rows' entries once and the node arrays u, w, v, f, 1/m once, and p where forces
act (what is written is read before); the bound is the bandwidth measured in the same run divided by that, of
the fastest memory that holds it. Below the bound lies what gathering costs: in the caches that, not the bandwidth,
is the limit. (A fifth of what a step of 1M moves can stay in the third level: a point may lie above its bound.) On two
threads the best of five processes counts, the slowest stands beside it: how a process's memory lies in the caches is
luck.""",
    "Numberings": """\
Million updates a second by `*JOB, ORDERING=`. NONE keeps the deck's order: here row by row, and at random,
which is the worst a mesh generator can do. Nothing need be chosen: HILBERT, the default, does not depend on the deck's
order, and METIS is as fast to within what two runs of the same one differ by. Only a mesh that lies row by row from the
start, as *MESH makes it, can be up to a fifth faster as it is, where it does not fit into the caches. The answer is the
same but for the order of sums (last bits).""",
    "Contact": """\
Straight: nine of twelve nodes in every 14th row are pairs of a closed crack, with friction. Crossing: an eighth of the
body, a corner, is full of cracks that cross each other, with four copies of the node where they do. The elastic step
is that of a body of the same size without cracks, measured in turn with the other in one process; on two threads the
ratio is the median of three processes, with the smallest and the largest.""",
    "A look at the criterion": """\
In units of a step of the same body. A beam that bends has few nodes near the largest utilisation; the last
column is the dearest look there is: every node is as near to failure as any other, and every patch is fitted.
Between two looks there are 300 to 2,000 steps.""",
    "A split event": """\
Medians over many events at random nodes, half of them at the newest nodes, without the relaxation that follows; in a
body that is whole at first, and in the cracked one of the contact table.
The columns on the right are parts of the whole event (medians too, which do not add up). The first event of a run
moves all arrays to where they have room to grow (factor 1.5).""",
    "Growth": """\
Million updates a second on one thread, contact left out, of a mesh whose nodes splitting at random has made 5 % more.
New nodes stand at the end of the numbering, far from their neighbours in memory; a run numbers its mesh anew after 1 %
of growth, and 512 nodes at least. Splitting leaves irregular triangles with more nodes and stiffness entries an
element, so that the rate before does not come back.""",
    "Memory": """\
Resident memory of a body at work. Everything on: cracks and pairs, criterion and stress of all nodes, the
equilibria that a run may come back to.""",
    "Files": """\
Wall time; the reading is that of the log's line `model:`.""",
    "Whole runs": """\
The paper's decks as they are, at TOLERANCE = EVENT TOLERANCE = 1e-6. The columns on the right are the log's
line `time:` in seconds. Contact after the step is part of the relaxation: groups of pairs that share nodes, pairs of
which each node lies in another block, and pairs that soften; the others are solved within the step.
Elements are those at the start, updates per second those of the relaxation alone, with the elements there are then.""",
    "Equilibrium from rest": """\
The beam above, from nothing to equilibrium. A relaxation needs iterations in proportion to the beam's length in
elements, so its time grows as N^1.5; a direct solver's grows less. Relaxation pays where a run is a long
sequence of states near each other, with contact, friction and growing cracks: it starts each from the last.""",
}


def stamp(figures, name):
    """When a part was measured, with what, and how many cores other work held meanwhile."""
    measured = figures.get("measured", {}).get(name)
    if not measured:
        return ""
    others = f"; other work held {measured['others']:.2f} cores meanwhile" if "others" in measured else ""
    return f"*{measured['date']}, {measured['version']}{others}.*"


def tables(figures):
    """All tables there are figures for."""
    parts = []
    for name, title, make in SECTIONS:
        if name not in figures:
            continue
        note = NOTES.get(title, "")
        parts.append("\n\n".join(text for text in (f"## {title}", note, stamp(figures, name), make(figures)) if text))
    return "\n\n".join(parts) + "\n"


def bandwidth_table(figures):
    """What the machine's memory brings."""
    rows = [
        [level, *[f"{figures['bandwidth'][threads]['bandwidth_' + level] / 1e9:.0f}" for threads in ("1", "2")]]
        for level in ("L2", "L3", "DRAM")
    ]
    return table(["triad a = b + s c, 24 bytes an element", "1 thread [GB/s]", "2 threads [GB/s]"], rows)


def write(figures, folder):
    """docs/performance.md and its figure."""
    machine = figures["machine"]
    roofline(figures, Path(folder) / "performance_roofline.png")
    head = f"""# Performance

Written by `./run bench --publish` (`tests/bench`); do not edit. Each part says when it was measured, all of them on:

- {machine["processor"]} ({machine["identity"]}), {machine["cores"]} cores, caches {machine["caches"]}, \
{machine["memory_gib"]:.0f} GiB of memory, {machine["system"]}
- {machine["compiler"]}; flags `{machine["flags"]}`

**How to read the figures.** The unit is element updates per second: elements x relaxation steps / time. Of many
measured windows the best one counts, because other work on the machine can only slow down; on one thread the
processor's time is taken, on two the clock's, so that two threads show their true speed only on a machine with nothing
else to do. A figure of another machine says nothing about this one, and figures of two runs differ by up to 10 %, on
two threads by up to 20 %: compare in one run, beside the bandwidth measured in it. *Must* and *goal* are what the
project set itself on a machine whose memory brings 86 / 27 to 36 / 16 GB/s a core from L2 / L3 / memory.

**Threads.** Between two steps a thread waits awake, because it would be late if it had to be woken. Where other work
holds the cores that costs much more than a second thread brings (tenfold was seen on two busy cores): take as many
threads as there are free cores (`--threads`), or let threads sleep (`OMP_WAIT_POLICY=passive`).

"""
    if "bandwidth" in figures:
        head += bandwidth_table(figures) + "\n\n"
        head += "![Million element updates per second against what a step moves](performance_roofline.png)\n\n"
    (Path(folder) / "performance.md").write_text(head + tables(figures), encoding="utf-8")


def roofline(figures, path):
    """Rates of the steps over the bytes that a step moves, and the bounds of the bandwidth."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7, 4.5))
    steps = plain_steps(figures)
    if not steps:
        return
    per_update = sum(row["bytes_per_step"] / row["elements"] for row in steps) / len(steps)
    for threads, colour in ((1, "tab:blue"), (2, "tab:orange")):
        rows = [row for row in steps if row["threads"] == threads]
        megabytes = [row["bytes_per_step"] / 1e6 for row in rows]
        label = "complete step, 1 thread" if threads == 1 else f"complete step, {threads} threads"
        axes.plot(megabytes, [rate(row) for row in rows], "o-", color=colour, label=label)
        wide = figures["bandwidth"][str(threads)]
        caches = figures["machine"]["cache_bytes"]
        edges = [0.8, threads * caches["L2"] / 1e6, caches["L3"] / 1e6, 400.0]
        for level, low, high in zip(("L2", "L3", "DRAM"), edges[:-1], edges[1:], strict=True):
            if high <= low:
                continue
            limit = wide["bandwidth_" + level] / per_update / 1e6
            axes.plot([low, high], [limit, limit], "--", color=colour, linewidth=1)
            axes.annotate(f"{level}, {threads}", (high, limit), ha="right", va="bottom", color=colour, fontsize=8)
    axes.set(xscale="log", xlabel="what a step moves [MB]", ylabel="million element updates per second", yscale="log")
    axes.set_title("Rates (points) and bounds of the measured bandwidth (dashed)", fontsize=10)
    axes.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
