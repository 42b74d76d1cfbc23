"""Segments that differ, and chains beside the tail, as tables of scenes."""

OWN_LINKS = [
    {"links": 3, "length": 0.06, "mass": 1.5e-3, "link_inertia": [4e-8, 2e-9, 3e-8]},
    {
        "links": 2,
        "link_lengths": "30, 25 mm",
        "link_masses": [5e-4, 4e-4],
        "link_centers": "14, 12 mm",
        "link_inertias": [[3e-8, 2e-9, 4e-8], [2e-8, 1e-9, 1e-8]],
    },
    {"links": 2, "length": 0.02, "mass": "0.2 g", "link_inertia": "2, 1, 2 g mm^2"},
]
OWN_ARCS = [{"length": "60 mm", "mass": "1.5 g"}, {"length": 0.09, "mass": 0.0011}]
# links and arcs alternate, so that the numbers of each kind differ from those of segments
MIXED = [
    {"kind": "continuum", **OWN_ARCS[0]},
    {"kind": "articulated", **OWN_LINKS[1]},
    {"kind": "continuum", **OWN_ARCS[1]},
    {"kind": "articulated", **OWN_LINKS[0]},
]
# pairs and single chains, links and arcs, passive parts of some chains alone
CHAINS = {
    "leg": {
        "pair": True,
        "kind": "articulated",
        "segments": OWN_LINKS[1:2],
        "mount": [0.01, 0.02, -0.003],
        "mount_angles": [0.4, -0.2, 1.3],
        "stiffness": [0.004, 0.006],
        "damping": [2e-4, 3e-4],
    },
    "second": {
        "kind": "continuum",
        "segments": OWN_ARCS[:1],
        "samples": 3,
        "mount": [0.002, 0.05, 0.01],
    },
    "third": {
        "kind": "articulated",
        "segments": 1,
        "links": 2,
        "mount": [-0.004, 0.01, 0.02],
        "mass": "1 g",
        "length": "40 mm",
        "damping": 2e-4,
        "stop_lower": -0.5,
        "stop_upper": [0.4, 0.6],
        "stop_stiffness": 0.05,
    },
}
# along -y and anywhere, all axes, without bodies, with springs, rotors and stops
LIMBS = {
    "leg": {
        "pair": True,
        "kind": "limb",
        "mount": [0.01, 0.02, -0.003],
        "mount_angles": [0.4, -0.2, 1.3],
        "joints": [
            {"name": "swing", "axis": "y", "damping": 1e-4},
            {"name": "hip", "length": "30 mm", "mass": "2 g", "radius": "4 mm"},
            {
                "name": "knee",
                "length": "20 mm",
                "mass": "1 g",
                "center": "0, -8, 0 mm",
                "inertia": "50, 4, 50 g mm^2",
                "stiffness": 0.004,
                "rest": -0.3,
                "stops": [-0.5, 0.4],
                "stop_stiffness": 0.05,
            },
        ],
    },
    "arm": {
        "kind": "limb",
        "mount": [0.002, 0.05, 0.01],
        "joints": [
            {"name": "turn", "axis": "z", "rotor": 2e-7},
            {
                "name": "lift",
                "tip": "5, -20, 3 mm",
                "mass": "1.5 g",
                "center": "2, -8, -4 mm",
                "inertia": "60, 40, 50 g mm^2",
                "rotor": 3e-7,
            },
            {
                "name": "wheel",
                "axis": "y",
                "tip": [0, 0, 0],
                "mass": "3 g",
                "inertia": "40, 70, 40 g mm^2",
            },
        ],
    },
}
# without passive parts: hinges and arcs, also of mirrored chains, on the ground
STRIDE = [{"name": "swing", "axis": "y"}, LIMBS["leg"]["joints"][1]]
FIN = CHAINS["second"] | {"pair": True, "mount_angles": [0.4, -0.2, 1.3]}
TOUCHING = {"leg": LIMBS["leg"] | {"joints": STRIDE}, "fin": FIN, "arm": LIMBS["arm"]}
TOUCHING = {"chain": TOUCHING, "contacts": ["torso", "arm", "fin", "leg", "tail"]}
