"""T1 events: of a flip of four, of packings in flow, of tracks; strains of tracked droplets by plain numpy."""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial import Delaunay

import jamlab
from jamlab.micrographs.tracks import with_strains
from jamlab.motion.t1_events import bonds, find_swaps

FLIP = [[-1.0, 0.0], [1.0, 0.0], [0.0, -2.0], [0.0, 2.0]]  # 0 and 1 touch, then 2 and 3


def table(*frames, order=None):
    rows = [(t, k, *xy) for t, places in enumerate(frames) for k, xy in enumerate(places)]
    found = pd.DataFrame(rows, columns=["frame", "particle", "x", "y"])
    return found if order is None else found.iloc[order.permutation(len(found))]


def squeezed(amount):
    return np.array(FLIP) * [1 + amount, 1 - amount]


def test_a_flip_of_four_is_one_event():
    frames = [squeezed(a) for a in (0.0, 0.1, 0.5, 0.6)]
    found = jamlab.t1_events(table(*frames))
    assert found.to_dataframe().to_dict("list") == {
        "state": [2], "parted_i": [0], "parted_j": [1], "met_i": [2], "met_j": [3], "place_x": [0.0], "place_y": [0.0],
    }  # fmt: skip
    assert found.counts.tolist() == [0, 1, 0] and found.gained.tolist() == found.lost.tolist() == [0, 1, 0]
    back = jamlab.t1_events(table(frames[2], frames[0]).set_index("frame", drop=False))  # as trackpy gives it
    assert (back.parted_i[0], back.parted_j[0], back.met_i[0], back.met_j[0]) == (2, 3, 0, 1)
    assert len(jamlab.t1_events(table(frames[0], frames[1]))) == 0


def test_events_are_those_of_every_quadruple():
    """Pairs that part and meet, each beside both of the other, found by trying all."""
    order = np.random.default_rng(5)
    places = order.random((90, 2)) * 9
    frames = [places, places + order.normal(0, 0.1, places.shape)]
    old, new = ({tuple(pair) for pair in bonds(each).tolist()} for each in frames)
    expected = [
        (*parted, *met)
        for parted in sorted(old - new)
        for met in sorted(new - old)
        if not {*parted} & {*met}
        and all(tuple(sorted((a, c))) in old and tuple(sorted((a, c))) in new for a in parted for c in met)
    ]
    assert len(expected) >= 2 and find_swaps(old, new) == expected
    found = jamlab.t1_events(table(*frames, order=order))
    assert list(zip(found.parted_i, found.parted_j, found.met_i, found.met_j, strict=True)) == expected


def test_packings_in_flow_and_the_same_in_other_images():
    p = jamlab.pack(n=32, pressure=1e-2, seed=1)
    run = jamlab.quasistatic_shear(p, strain=0.2, strain_step=2e-2, snapshot_every=2e-2)
    found = jamlab.t1_events(run)
    assert len(found) > 3 and found.steps.tolist() == list(range(1, 11)) and found.counts.sum() == len(found)
    assert len(jamlab.t1_events([p, p])) == 0
    order = np.random.default_rng(2)
    moved = []
    for each in run.frames:
        box = each.box + np.array([[0, 0], [1, 0]]) * each.box[0]
        moved.append(each.with_state(box=box, positions=each.positions + order.integers(-2, 3, (32, 2)) @ each.box))
    again = jamlab.t1_events(moved)
    for name in ("state", "parted_i", "parted_j", "met_i", "met_j", "gained"):
        np.testing.assert_array_equal(getattr(again, name), getattr(found, name))
    inside = (found.place - again.place) @ np.linalg.inv(p.box)
    assert np.abs(inside[:, 1] - np.rint(inside[:, 1])).max() < 1e-6  # the same but for lattice vectors
    assert found.plot().get_xlabel() == "state"


def test_long_edges_and_points_on_a_line_are_no_bonds():
    assert bonds(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])).shape == (0, 2)
    assert bonds(np.zeros((1, 2))).shape == (0, 2)
    lattice = np.array([[i + 0.5 * (j % 2), 0.8 * j] for i in range(4) for j in range(4)])
    far = np.concatenate([lattice, [[30.0, 1.0]]])
    assert 16 not in bonds(far) and len(bonds(lattice)) > 30


def test_strains_of_tracks_by_plain_numpy():
    """Each droplet's neighbours in the frame before, the best map, and what it leaves; droplets come and go."""
    order = np.random.default_rng(6)
    x = np.array([[i + 0.5 * (j % 2), 0.87 * j] for i in range(5) for j in range(5)]) + order.normal(0, 0.1, (25, 2))
    frames = [x, x @ np.array([[1.0, 0.1], [0.0, 0.95]]).T + order.normal(0, 0.05, x.shape)]
    rows = table(*frames, order=order)
    rows = rows[~((rows["frame"] == 1) & (rows["particle"] == 7))]
    found = with_strains(rows).set_index(["frame", "particle"]).sort_index()
    assert found.loc[0, "d2min"].isna().all() and (found.loc[0, "t1"] == 0).all() and 7 not in found.loc[1].index
    kept = [k for k in range(25) if k != 7]
    old, new = (frame[kept] for frame in frames)
    corners = Delaunay(old).simplices
    edges = {tuple(sorted(pair)) for a, b, c in corners.tolist() for pair in ((a, b), (b, c), (a, c))}
    length = {pair: float(np.hypot(*(old[pair[0]] - old[pair[1]]))) for pair in edges}
    longest = 1.6 * np.median(list(length.values()))
    edges = [pair for pair in edges if length[pair] <= longest]
    for row, name in enumerate(kept):
        beside = [a + b - row for a, b in edges if row in (a, b)]
        first, second = old[beside] - old[row], new[beside] - new[row]
        best = np.linalg.lstsq(first, second, rcond=None)[0].T
        own = found.loc[(1, name)]
        if len(beside) < 3:
            assert np.isnan(own["d2min"]) and np.isnan(own["strain_xx"])
            continue
        assert own["d2min"] == pytest.approx(((second - first @ best.T) ** 2).sum(), rel=1e-10)
        values = own[["strain_xx", "strain_xy", "strain_yx", "strain_yy"]].to_numpy(float)
        np.testing.assert_allclose(values, (best - np.eye(2)).ravel(), atol=1e-10)
    swaps = jamlab.t1_events(rows[rows["particle"] != 7])
    ends = np.bincount(np.concatenate([swaps.parted_i, swaps.parted_j, swaps.met_i, swaps.met_j]), minlength=25)
    np.testing.assert_array_equal(found.loc[1, "t1"], ends[kept])


def test_tracked_pictures_have_strains():
    pytest.importorskip("skimage")
    row, column = np.mgrid[:140, :140] + 0.5
    labels = []
    for stretch in (1.0, 1.04):
        at = np.array([[(i + 0.5) * 28 * stretch, (j + 0.5 + 0.25 * (i % 2)) * 26] for i in range(4) for j in range(4)])
        away = np.hypot(column[..., None] - at[:, 0], row[..., None] - at[:, 1])
        labels.append(np.where(away.min(axis=-1) < 11, away.argmin(axis=-1) + 1, 0))
    tracks = jamlab.track_droplets(labels=labels)
    later = tracks[tracks["frame"] == 1]
    assert later["strain_xx"].median() == pytest.approx(0.04, abs=0.01)
    assert later["strain_yy"].abs().median() < 0.01 and later["d2min"].median() < 1.0 and (later["t1"] == 0).all()


def test_numbers_with_room_for_gaps_are_numbers():
    tracks = table(FLIP, FLIP[::-1])
    gaps = tracks.astype({"frame": "Int64", "particle": "Int64", "x": "Float64"})
    one, two = jamlab.t1_events(tracks), jamlab.t1_events(gaps)
    assert len(one) == 1 and np.array_equal(one.met_i, two.met_i) and np.array_equal(one.place, two.place)


SMALL = jamlab.jam(4)
GOOD = table(FLIP, FLIP)
BAD = {
    "small box": (lambda: jamlab.t1_events([SMALL, SMALL]), "n = 4, meets across the box.*larger packing"),
    "one state": (lambda: jamlab.t1_events([SMALL]), "give 2 or more"),
    "no column": (lambda: jamlab.t1_events(GOOD.drop(columns="y")), "no column 'y'"),
    "one frame": (lambda: jamlab.t1_events(GOOD[GOOD["frame"] == 0]), r"1 frame\(s\): give two or more"),
    "no rows": (lambda: jamlab.t1_events(GOOD.iloc[:0]), "give two or more"),
    "twice": (lambda: jamlab.t1_events(pd.concat([GOOD, GOOD.iloc[:1]])), "particle 0 is twice in frame 0"),
    "nan": (lambda: jamlab.t1_events(GOOD.assign(x=np.nan)), "must be finite numbers: drop"),
    "text": (lambda: jamlab.t1_events(GOOD.assign(x="a")), "must be finite numbers: drop"),
    "half a frame": (lambda: jamlab.t1_events(GOOD.assign(frame=0.5 * GOOD["frame"])), "frame = 0.5 in row 4.*whole"),
    "half a particle": (lambda: jamlab.t1_events(GOOD.assign(particle=0.5 * GOOD["particle"])), "particle = 0.5 in"),
    "categories": (lambda: jamlab.t1_events(GOOD.astype({"particle": "category"})), "must be finite numbers: drop"),
    "array": (lambda: jamlab.t1_events(GOOD.to_numpy()), "run = array"),
    "nothing": (lambda: jamlab.t1_events([]), r"run has 0 packing\(s\)"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_named_with_a_remedy(case):
    call, words = BAD[case]
    with pytest.raises(jamlab.JamlabError, match=words) as refused:
        call()
    assert "\n" not in str(refused.value)
