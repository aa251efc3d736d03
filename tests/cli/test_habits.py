"""Words typed from habit lead to what exists, by meaning; names that only look alike are no hint."""

import pytest
from commands import call


@pytest.mark.parametrize(
    ("name", "use"),
    [
        ("track", "analyze"),
        ("restart", "interrupted"),
        ("sweep", "compress"),
        ("examples", "decks"),
        ("unjam", "decompress"),
        ("analize", "analyze"),
        ("stress", "in Python use `jamlab.evaluate(packing).stress`"),
        ("oscillation", "use `jamlab oscillate`"),
        ("gravity", "limits.md"),
        ("spam", "use one of"),
        ("creeping", "use one of"),
    ],
)
def test_commands(tmp_path, name, use):
    done = call(tmp_path, name)
    assert done.exit_code == 2 and use in done.stderr


@pytest.mark.parametrize(
    ("line", "use"),
    [
        ("analyze p.h5 --show", "use `jamlab explore`"),
        ("jam --phi 0.8", "`jamlab pack --phi`"),
        ("shear p.h5 --shear-rate 1", "use --rate"),
        ("jam --threads 2", "use --ranks"),
        ("flow-curve p.h5 --threads 2", "use --workers"),
        ("gstar p.h5 --processes 2", "use one process: gstar has no more"),
        ("gstar p.h5 --beta 0.5", "use --damping beta=VALUE"),
        ("creep p.h5 --stokes", "use --damping stokes"),
        ("jam --gamma 0.3", "use --law gamma=VALUE"),
        ("jam --force", "use --overwrite"),
        ("analyze p.h5 --quantities z", "use --quantity"),
        ("relax p.xyz --style bond", "use --atom-style"),
        ("shear p.h5 --rate 1 --frames 0.1", "use --snapshot-every"),
        ("compress p.h5 --error 0.1", "use --pressure-tolerance"),
        ("gstar p.h5 --freq 2", "use --omega-min"),
        ("jam --force-tolerence 1e-9", "use --force-tolerance"),
        ("jam --tolerance 1e-9", "use --force-tolerance"),
        ("campaign run c.toml --out x", "use --folder"),
        ("jam --colour 2", "it takes --model, "),
    ],
)
def test_options(tmp_path, line, use):
    done = call(tmp_path, *line.split())
    assert done.exit_code == 2 and use in done.stderr and "Possible" not in done.stderr
