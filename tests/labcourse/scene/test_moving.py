"""Drawings that move: how they are packed, what is refused, and where the page's script puts a point."""

import numpy as np
import pytest
from checkout import ROOT

from labcourse.errors import CourseError
from labcourse.scene.live import LiveExplorer
from labcourse.scene.scene import GROUND, MOST_POINTS, Column, Moving, Panel, Play, Scene, thinned

FOLDER = ROOT / "labcourse" / "scene"
SIGNALS = {"x": 0.7, "angle": 0.4, "bend": -1.1}

CART = GROUND.shifted(2, -0.5, by="x")
ROD = CART.turned(by="angle")
TIP = ROD.shifted(0.3, -1.5).turned(by="bend")
FRAMES = {"ground": GROUND, "cart": CART, "rod": ROD, "tip": TIP}


def drawing(**signals):
    return Moving(signals or SIGNALS, x=(-4, 4), y=(-3, 3))


def turn(angle):
    return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])


def shift(x, y):
    return np.array([[1, 0, x], [0, 1, y], [0, 0, 1]])


def expected(frame, point, x, angle, bend):
    """Where a point of one of the frames stands, by matrices written out for each of them."""
    cart = shift(2 * x, -0.5 * x)
    rod = cart @ turn(angle)
    tip = rod @ shift(0.3, -1.5) @ turn(bend)
    return ({"ground": np.eye(3), "cart": cart, "rod": rod, "tip": tip}[frame] @ [*point, 1])[:2]


@pytest.mark.parametrize(
    ("draw", "name"),
    [
        (lambda one: one.line(GROUND.at(0, 0), GROUND.turned(by="angel").at(0, 1), "model"), "angel"),
        (lambda one: one.rectangle(ROD.shifted(0, 1, by="y"), (0, 0), (1, 1)), "y"),
        (lambda one: one.spring(CART.turned(by="phi").at(0, 0), CART.at(1, 0), "model"), "phi"),
        (lambda one: one.reading("v", "speed"), "speed"),
    ],
)
def test_a_signal_that_there_is_not_is_refused_where_it_is_named(draw, name):
    shown = drawing()
    with pytest.raises(CourseError) as refused:
        draw(shown)
    assert str(refused.value) == f"The drawing has no signal {name!r}; it has x, angle, bend."
    assert shown.shapes == shown.readings == []


def test_a_recorded_signal_that_moves_nothing_is_refused():
    play = Play({"angle": np.zeros(3), "speed": np.zeros(3)}, 1.0)
    with pytest.raises(CourseError, match=r"'speed'.*bend, x"):
        Scene("a crane", [Column([Panel("y", (0, 1), (0, 1)), drawing()])], play=play).packed()


# What a pen is asked to do, in px on the canvas.
PEN = """() => {
    let [ox, oy, turned] = [0, 0, 0];
    const calls = [];
    const place = (x, y) => [ox + x * Math.cos(turned) - y * Math.sin(turned),
        oy + x * Math.sin(turned) + y * Math.cos(turned)];
    const kept = {
        moveTo: (x, y) => calls.push(['to', ...place(x, y)]), lineTo: (x, y) => calls.push(['to', ...place(x, y)]),
        arc: (x, y, radius) => calls.push(['arc', ...place(x, y), radius]),
        rect: (x, y, w, h) => calls.push(
            ['rect', ...place(x, y), ...place(x + w, y), ...place(x + w, y + h), ...place(x, y + h)]),
        fillText: (text) => calls.push(['text', text]),
        translate: (x, y) => { [ox, oy] = place(x, y); }, rotate: (angle) => { turned += angle; },
        restore: () => { [ox, oy, turned] = [0, 0, 0]; },
    };
    return [calls, new Proxy(kept, { get: (found, name) => found[name] ?? (() => {}), set: () => true })];
}"""
DRAWN = f"""([panel, pose, box]) => {{
    const [calls, pen] = ({PEN})();
    moving({{ pose, color: (name) => name }}, pen, panel, box);
    return calls;
}}"""
BOX = {"left": 30, "top": 10, "width": 400, "height": 224}  # 200 px for 6 units of height
UNIT, MIDDLE = 200 / 6, (30 + 400 / 2, 10 + 24 + 100)


@pytest.fixture(scope="module")
def page(chromium):
    page = chromium.new_page()
    for name in ("drawing.js", "moving.js"):
        page.add_script_tag(content=(FOLDER / name).read_text(encoding="utf-8"))
    yield page
    page.close()


def on_canvas(point):
    return MIDDLE[0] + point[0] * UNIT, MIDDLE[1] - point[1] * UNIT


def drawn(page, shown, pose=None):
    return page.evaluate(DRAWN, [shown.packed(), pose, BOX])


@pytest.mark.parametrize("frame", FRAMES)
def test_a_point_stands_where_plain_matrices_put_it(page, frame):
    for *point, x, angle, bend in np.random.default_rng(1).uniform(-3, 3, (20, 5)).tolist():
        signals = {"x": x, "angle": angle, "bend": bend}
        packed = FRAMES[frame].at(*point).packed()
        found = page.evaluate("([point, signals]) => standing(point, signals)", [packed, signals])
        assert found == pytest.approx(expected(frame, point, **signals), abs=1e-12)


def test_shapes_are_drawn_to_scale_where_their_points_stand(page):
    shown = drawing()
    shown.circle(GROUND.at(1, 0), 2.5, "grid")
    shown.rectangle(ROD, (-0.4, -0.1), (0.2, 0.3))
    shown.line(ROD.at(0, 0), TIP.at(0, -1), "measured", width=5)
    shown.dot(CART.at(0, 1), 3)
    _, circle, rectangle, start, end, dot = drawn(page, shown)

    def where(frame, *point):
        return pytest.approx(on_canvas(expected(frame, point, **SIGNALS)), abs=1e-9)

    assert circle[1:3] == where("ground", 1, 0) and circle[3] == pytest.approx(2.5 * UNIT)
    corners = [(-0.4, -0.1), (0.2, -0.1), (0.2, 0.3), (-0.4, 0.3)]
    for number, corner in enumerate(corners):
        assert rectangle[1 + 2 * number : 3 + 2 * number] == where("rod", *corner)
    assert start[1:] == where("rod", 0, 0) and end[1:] == where("tip", 0, -1)
    assert dot[1:3] == where("cart", 0, 1) and dot[3] == 3


def test_a_spring_goes_from_point_to_point_and_swings_to_both_sides(page):
    shown = drawing()
    shown.spring(GROUND.at(-3, 1), CART.at(0, 0), "model", turns=6, swing=5)
    zigzag = np.array([place for what, *place in drawn(page, shown) if what == "to"])
    ends = np.array([on_canvas((-3, 1)), on_canvas(expected("cart", (0, 0), **SIGNALS))])
    assert zigzag[[0, -1]] == pytest.approx(ends)
    along = np.subtract(*ends[::-1]) / np.linalg.norm(ends[1] - ends[0])
    aside = (zigzag[1:-1] - ends[0]) @ [along[1], -along[0]]
    assert np.abs(aside) == pytest.approx(np.full(6, 5.0))
    assert (np.diff(np.sign(aside)) != 0).all()


def test_what_is_played_takes_the_place_of_what_is_now_and_the_rest_stays(page):
    shown = drawing()
    shown.dot(ROD.at(1, 0))
    shown.reading("x", "x", " m", digits=2)
    shown.reading("φ", "angle", "°", 180 / np.pi)
    words, dot = drawn(page, shown)
    assert words[1] == "x 0.70 m   φ 22.9°"
    assert dot[1:3] == pytest.approx(on_canvas(expected("rod", (1, 0), **SIGNALS)))
    words, dot = drawn(page, shown, {"angle": -0.5})
    assert words[1] == "x 0.70 m   φ -28.6°"
    assert drawn(page, shown, {"angle": -1e-4})[0][1] == "x 0.70 m   φ 0.0°"
    assert dot[1:3] == pytest.approx(on_canvas(expected("rod", (1, 0), **SIGNALS | {"angle": -0.5})))


def test_a_narrow_box_shows_all_of_the_drawing(page):
    shown = drawing()
    shown.circle(GROUND.at(0, 0), 1, "grid")
    _, circle = page.evaluate(DRAWN, [shown.packed(), None, BOX | {"width": 160}])  # 160 px for 8 units of width
    assert circle[1:] == pytest.approx([30 + 80, 10 + 24 + 3 * 20, 20])


PLAYED = """async ([module, scene, data, times]) => {
    const { render } = await import(URL.createObjectURL(new Blob([module], { type: 'text/javascript' })));
    const values = { scene, data: new DataView(Float32Array.from(data).buffer) };
    document.body.replaceChildren();
    const model = { get: (name) => values[name], on() {}, off() {}, send() {} };
    const close = render({ model, el: document.body });
    let written = '';
    const write = CanvasRenderingContext2D.prototype.fillText;
    CanvasRenderingContext2D.prototype.fillText = function (text, ...rest) {
        written = text;
        write.call(this, text, ...rest);
    };
    const said = times.map((time) => {
        const range = document.querySelector('.player input');
        range.value = time;
        range.dispatchEvent(new Event('input'));
        return written;
    });
    CanvasRenderingContext2D.prototype.fillText = write;
    close();
    return said;
}"""


def test_the_player_goes_through_recorded_signals_by_name(page):
    shown = drawing()
    for name in SIGNALS:
        shown.reading(name, name, digits=2)
    recorded = {"angle": np.linspace(0, 8, 5), "x": np.array([-1.0, 1.0, 3.0])}  # evenly spaced, each in its own way
    scene, data = Scene("a crane", [Column([shown])], play=Play(recorded, 2.0)).packed()
    numbers = np.frombuffer(data, np.float32).tolist()
    said = page.evaluate(PLAYED, [LiveExplorer._esm, scene, numbers, [0.0, 1.0, 1.5, 2.0]])
    assert said == [
        "x -1.00   angle 0.00   bend -1.10",
        "x 1.00   angle 4.00   bend -1.10",
        "x 3.00   angle 6.00   bend -1.10",
        "x 3.00   angle 8.00   bend -1.10",
    ]


def test_a_curve_of_fewer_points_runs_forward_and_keeps_its_peaks():
    x = np.linspace(0.0, 1.0, 20_001)
    kept, heights = thinned(x, np.sin(40 * x))
    assert kept.size <= MOST_POINTS and np.all(np.diff(kept) >= 0)
    assert (heights.min(), heights.max()) == (np.sin(40 * x).min(), np.sin(40 * x).max())
