// The chains of a model: the tail, and others whose parameters have names of their own.

// What a parameter of the tail is called in a chain.
export const nameIn = (owner, name) => (owner ? `${owner}_${name.replace(/^tail_/, "")}` : name);

// The mass of the torso and of all chains, whose pieces have masses of their own, or one together.
export function massOf(engine) {
  const of = (name) => [...(engine.parameter(name) ?? [])];
  const chains = engine.live.chains.flatMap(({ owner }) => {
    const pieces = ["link_masses", "arc_masses"].flatMap((name) => of(nameIn(owner, name)));
    return pieces.length ? pieces : of(nameIn(owner, "tail_mass"));
  });
  return [...of("torso_mass"), ...chains].reduce((all, mass) => all + mass, 0);
}

// Gives equal links the inertia of ellipsoids, which follows from mass, length and radius.
export function shapeLinks(engine, of) {
  for (const { owner, points } of engine.live.chains) {
    const own = (name) => engine.parameter(nameIn(owner, name));
    const knob = engine.live.knobs.find(({ name }) => name === nameIn(owner, "link_radius"));
    if (!knob) continue;
    const count = points[1] - points[0] - 1;
    const [m, length] = ["tail_mass", "tail_length"].map((name) => own(name)[0] / count);
    const r = of(knob);
    const across = (m / 5) * ((length * length) / 4 + r * r);
    own("link_inertia").set([across, (m / 5) * (2 * r * r), across]);
  }
}
