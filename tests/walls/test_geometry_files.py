"""Bodies from files."""

import jax.numpy as jnp
import numpy as np
import pytest
import trimesh

from jaxsph import (
    BallRegion,
    Box,
    BoxRegion,
    FreeBody,
    Outline,
    SampledDistance,
    Space,
    Walls,
    outline_from_file,
    solid_from_file,
)
from jaxsph.kernels import WendlandC2

SQUARE = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)]


def test_a_table_is_read_scaled_and_moved(tmp_path):
    path = tmp_path / "box.dat"
    path.write_text("NAME 12\n" + "\n".join(f"{x} {y}" for x, y in SQUARE) + "\n\n")
    found = outline_from_file(path, scale=0.5, offset=(1.0, 0.0))
    assert found == Outline([[(1.0, 0.0), (2.0, 0.0), (2.0, 0.5), (1.0, 0.5)]])
    path.write_text("x,y\n" + "\n".join(f"{x},{y}" for x, y in SQUARE)
                    + "\n\n0.5,0.25\n1.0,0.25\n1.0,0.75\n")  # fmt: skip
    assert len(outline_from_file(path).rings) == 2


def test_an_airfoil_s_two_sides_are_one_polygon(tmp_path):
    """Lednicer's order: both sides from the leading edge on, their corners counted on top."""
    upper, lower = [(0.0, 0.0), (0.3, 0.06), (1.0, 0.0)], [(0.0, 0.0), (0.4, -0.05), (1.0, 0.0)]
    rows = "\n\n".join("\n".join(f"{x} {y}" for x, y in side) for side in (upper, lower))
    path = tmp_path / "naca.dat"
    path.write_text(f"NACA\n 3. 3.\n\n{rows}\n")
    (ring,) = outline_from_file(path).rings
    assert set(ring) == {*upper, *lower}
    inside = outline_from_file(path).signed_distance(np.array([[0.35, 0.0], [0.35, 0.1]])) < 0.0
    assert inside.tolist() == [True, False]
    path.write_text("3 3\n0 1\n1 0\n")  # three corners of a polygon, no counts
    assert len(outline_from_file(path).rings[0]) == 3
    for table in ("2 2\n4 2\n4 4\n2 4\n2 2", "3 4\n5 4\n5 6\n3 6\n\n10 4\n12 4\n12 6\n10 6"):
        path.write_text(table)  # squares that might be counts and sides
        assert [len(r) for r in outline_from_file(path).rings] == [4] * len(table.split("\n\n"))
    path.write_text("3 3\n0 1\n")
    with pytest.raises(ValueError, match="naca.dat: Outline: a polygon has at least three"):
        outline_from_file(path)


def test_drawings_are_read(tmp_path):
    path = tmp_path / "box.svg"
    path.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 4 4">'
        '<path d="M 0 0 L 2 0 L 2 1 L 0 1 Z"/></svg>'
    )
    square = outline_from_file(path)
    points = jnp.asarray(np.random.default_rng(0).uniform(-1.0, 3.0, (50, 2)))
    expected = Outline([SQUARE]).signed_distance(points)
    np.testing.assert_allclose(square.signed_distance(points), expected, atol=1e-9)
    drawn = trimesh.path.creation.circle(radius=0.5)
    drawn.export(str(tmp_path / "disc.dxf"))
    disc = outline_from_file(tmp_path / "disc.dxf").signed_distance(points)
    exact = BallRegion((0.0, 0.0), 0.5).signed_distance(points)
    np.testing.assert_allclose(disc, exact, atol=0.02 * 0.5)  # by how finely it draws arcs


def test_a_drawing_stands_as_it_is_drawn(tmp_path):
    """An L whose foot is drawn at the lower right, where an SVG's y is greater."""
    path = tmp_path / "l.svg"
    path.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg"><path d="M0,1 L1,1 L1,3 L3,3 L3,4 L0,4 Z"/></svg>'
    )
    outline = outline_from_file(path, scale=2.0, offset=(0.0, 1.0))
    foot, above = outline.signed_distance(jnp.asarray([[5.0, 4.0], [5.0, 8.0]]))
    assert foot < 0.0 < above


def test_a_surface_that_faces_inwards_is_turned_round(tmp_path):
    turned, mixed = trimesh.creation.box(), trimesh.creation.box()
    turned.invert()
    mixed.faces[:2] = mixed.faces[:2, ::-1]
    found = []
    for name, mesh in (("box", trimesh.creation.box()), ("turned", turned), ("mixed", mixed)):
        mesh.export(str(tmp_path / f"{name}.stl"))
        found.append(solid_from_file(tmp_path / f"{name}.stl", 0.25))
    points = jnp.asarray(np.random.default_rng(0).uniform(-0.7, 0.7, (50, 3)))
    for other in found[1:]:
        expected = found[0].signed_distance(points)
        np.testing.assert_allclose(other.signed_distance(points), expected, atol=1e-12)


@pytest.mark.parametrize("inverted", [False, True])
def test_a_cavity_stays_one(tmp_path, inverted):
    """A box with a void in it, whichever way its surfaces face."""
    inner = trimesh.creation.box((0.4,) * 3)
    inner.invert()
    hollow = trimesh.util.concatenate([trimesh.creation.box(), inner])
    if inverted:
        hollow.invert()
    hollow.export(str(tmp_path / "hollow.stl"))
    region = solid_from_file(tmp_path / "hollow.stl", 0.05)
    void, solid, out = region.signed_distance(jnp.asarray([[0.0] * 3, [0.35] * 3, [0.6] * 3]))
    assert void > 0.0 > solid and out > 0.0


@pytest.mark.slow
def test_a_ball_s_surface_is_that_of_the_ball(tmp_path):
    path, radius, spacing = tmp_path / "ball.stl", 0.5, 0.05
    trimesh.creation.icosphere(subdivisions=4, radius=1e3 * radius).export(str(path))
    ball = solid_from_file(path, spacing, scale=1e-3, offset=(1.0, 1.0, 1.0))
    exact = BallRegion((1.0, 1.0, 1.0), radius)
    rng = np.random.default_rng(0)
    way = rng.normal(size=(500, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    near = jnp.asarray(1.0 + way * (radius + rng.uniform(-0.1, 0.1, (500, 1))))
    found, expected = ball.signed_distance(near), exact.signed_distance(near)
    # of the grid n delta^2 / (8 R) at R = 0.4, and the triangles' own
    assert float(jnp.abs(found - expected).max()) < 3 * spacing**2 / (8 * 0.4) + 1e-3 * radius
    far = jnp.asarray(rng.uniform(-2.0, 4.0, (200, 3)))
    assert bool((jnp.sign(ball.signed_distance(far)) == jnp.sign(exact.signed_distance(far))).all())
    again = solid_from_file(path, spacing, scale=1e-3, offset=(1.0, 1.0, 1.0))
    assert again == ball and hash(again) == hash(ball)
    assert ball != solid_from_file(path, 0.06, scale=1e-3, offset=(1.0, 1.0, 1.0))


def test_walls_stand_around_a_body_from_a_file(tmp_path):
    path = tmp_path / "ball.ply"
    trimesh.creation.icosphere(subdivisions=3, radius=0.5).export(str(path))
    ball = solid_from_file(path, 0.05, offset=(1.0, 1.0, 1.0))
    space = Space(Box((0.0,) * 3, (2.0,) * 3, (True,) * 3), WendlandC2(), 0.15, 0.1)
    everywhere = BoxRegion((-np.inf,) * 3, (np.inf,) * 3)
    found = Walls.around(everywhere & ~ball, space)
    exact = Walls.around(everywhere & ~BallRegion((1.0,) * 3, 0.5), space)
    assert abs(len(found.position) - len(exact.position)) < 0.1 * len(exact.position)
    outward = np.asarray(found.position) - 1.0
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    surface = np.linalg.norm(np.asarray(found.position) - 1.0, axis=1) > 0.3
    assert ((outward * np.asarray(found.normal)).sum(axis=1)[surface] > 0.97).all()


def test_a_body_from_a_file_with_edges_is_moved_by_the_fluid(tmp_path):
    """A can seven spacings across: deep under its edges two of its faces are as near."""
    path, dx = tmp_path / "can.stl", 0.1
    trimesh.creation.cylinder(radius=0.35, height=0.7, sections=96).export(str(path))
    can = solid_from_file(path, 0.5 * dx, offset=(0.7, 0.7, 0.7))
    space = Space(Box((0.0,) * 3, (1.4,) * 3, (False,) * 3), WendlandC2(), 1.3 * dx, dx)
    body = FreeBody.of_density(can, 300.0, space)
    # the grid cuts edges off
    assert float(body.mass) == pytest.approx(300.0 * np.pi * 0.35**2 * 0.7, rel=0.02)
    walls = Walls.around(BoxRegion((0.0,) * 3, (1.4,) * 3), space, free_bodies=(body,))
    own = np.asarray(walls.free.owner) == 0
    arm, normal = (np.asarray(a)[own] for a in (walls.position - 0.7, walls.normal))
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-12)
    side = np.hypot(arm[:, 0], arm[:, 1]) > np.abs(arm[:, 2]) + 0.1
    outward = arm[side, :2] / np.linalg.norm(arm[side, :2], axis=1, keepdims=True)
    assert ((outward * normal[side, :2]).sum(axis=1) > 0.97).all()
    assert ((arm * normal).sum(axis=1) > 0.0).all()


def test_what_is_no_body_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no such file"):
        outline_from_file(tmp_path / "none.dat")
    path = tmp_path / "text.dat"
    path.write_text("nothing here\n")
    with pytest.raises(ValueError, match="two columns"):
        outline_from_file(path)
    path = tmp_path / "open.svg"
    path.write_text('<svg xmlns="http://www.w3.org/2000/svg"><path d="M 0 0 L 2 0 L 2 1"/></svg>')
    with pytest.raises(ValueError, match="no closed outline"):
        outline_from_file(path)
    for name in ("bad.svg", "bad.dxf"):
        (tmp_path / name).write_text("no drawing")
        with pytest.raises(ValueError, match=f"{name}: could not be read as a drawing"):
            outline_from_file(tmp_path / name)
    mesh = trimesh.creation.box()
    mesh.update_faces(np.arange(len(mesh.faces)) > 1)
    mesh.export(str(tmp_path / "open.stl"))
    with pytest.raises(ValueError, match="not closed"):
        solid_from_file(tmp_path / "open.stl", 0.1)
    (tmp_path / "bad.stl").write_text("no surface")
    with pytest.raises(ValueError, match="bad.stl"):
        solid_from_file(tmp_path / "bad.stl", 0.1)
    with pytest.raises(ValueError, match="spacing: must be positive"):
        solid_from_file(tmp_path / "open.stl", 0.0)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.ones((4, 4)), "negative in the region"),
        (np.full((4, 4), np.nan), "finite"),
        (np.ones((4, 4, 4)), "for 2 dimensions"),
        (np.where(np.arange(4) < 1, -1.0, 1.0)[:, None] + np.zeros((4, 4)), "grid's edge"),
    ],
    ids=["no region", "not finite", "in space", "cut off"],
)
def test_samples_that_hold_no_region_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        SampledDistance((0.0, 0.0), 0.1, values)
