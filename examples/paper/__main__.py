"""Plans one flight as the paper does, with several rules and nodes, and as `st.plan` does.

effort: integral of tau^2, (mN m)^2 s; `st.plan` also weighs rates, unless smoothing is 0.
error: angle in deg, at the end, from the torso's planned attitude to where the torques truly lead.
"""

from examples import front

SEED = 4  # of the random start, from which the paper's program converges
WAYS = {
    "paper, trapezoidal, 59 nodes": {},
    "paper, translation-free": {"formulation": "translation-free"},
    "paper, trapezoidal, 201 nodes": {"nodes": 201},
    "paper, Hermite-Simpson, 59 nodes": {"rule": "hermite-simpson"},
}
OURS = {"st.plan": {}, "st.plan, smoothing = 0": {"smoothing": 0.0}}


def main() -> None:
    """Print a table."""
    import serpentail as st
    from examples import righting
    from examples.paper.collocation import paper_plan
    from examples.studies import righting_paper

    rat = righting.model(1, 3)
    start, limits = righting.tumbling(rat, SEED), righting.bounds(rat)
    rows = {}
    for way, settings in WAYS.items():
        plan = paper_plan(rat, start, righting.FLIGHT, limits, **settings)
        rows[way] = righting_paper.row(rat, plan)
    for way, settings in OURS.items():
        task = {"start": start, "duration": righting.FLIGHT, "bounds": limits}
        rows[way] = righting.row(st.plan(rat, **task, **settings))
    print(f"{'':<34}{'iterations':>10}{'effort':>10}{'CPU [s]':>10}{'error':>10}")
    for way, row in rows.items():
        numbers = 1e6 * row["effort"], row["solve_cpu_s"], row["open_loop_attitude_error_deg"]
        print(f"{way:<34}{row['iterations']:>10}" + "".join(f"{x:>10.4f}" for x in numbers))


if __name__ == "__main__":
    front.parser(__doc__).parse_args()
    front.run(main)
