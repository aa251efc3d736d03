"""The explorer in a real browser: what it shows is what the library computes, by mouse, touch and keyboard."""

import re
from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.packing.deformation import at_phi

STATES = Path(__file__).parents[1] / "figures" / "states"
EXPLORER = "document.querySelector('.explorer').explorer"


@pytest.fixture(scope="module")
def sweep():
    """Droplets at a minimum; decompressed, one of them moved; decompressed and not converged; and all loose."""
    dense = jamlab.read(STATES / "droplets.h5")
    loose, looser, fluid = (at_phi(dense, phi * dense.phi) for phi in (0.998, 0.995, 0.7))
    moved = loose.with_state(positions=loose.positions + np.where(loose.particle == 0, 0.01, 0.0)[:, None])
    return [dense, moved, looser.with_state(max_force=1e-3, converged=False), fluid]


@pytest.fixture(scope="module")
def page(sweep, tmp_path_factory):
    path = tmp_path_factory.mktemp("explorer") / "page.html"
    jamlab.write_page(path, sweep)
    return path


def picture(browser):
    """The canvas as it stands once everything is drawn."""
    return browser.run(f"{EXPLORER}.drawNow(); return document.querySelector('canvas').toDataURL()")


def press(browser, *keys):
    from selenium.webdriver import ActionChains

    chain = ActionChains(browser.driver)
    for key in keys:
        chain.send_keys(key)
    chain.perform()


def point_at(browser, x, y):
    """Move the mouse to a point of the packing."""
    from selenium.webdriver import ActionChains

    canvas = browser.element("canvas")
    px, py = browser.run(f"return {EXPLORER}.view.toScreen(...values)", x, y)
    middle = canvas.size["width"] / 2, canvas.size["height"] / 2
    ActionChains(browser.driver, duration=0).move_to_element_with_offset(
        canvas, round(px - middle[0]), round(py - middle[1])
    ).perform()


def tip(browser):
    return browser.wait(lambda: browser.element(".tip").text)


def quantity(text, name):
    return float(re.search(rf"{name} (\S+)", text)[1].replace("−", "-"))


def current(browser):
    return browser.run(f"return {EXPLORER}.current")


def test_slider_and_keys_move_the_picture(browser, page):
    from selenium.webdriver import Keys

    browser.open(page)
    pictures, texts = [picture(browser)], [browser.element(".numbers").text]
    press(browser, Keys.ARROW_RIGHT)  # the page has the keyboard at once
    for _ in range(2):
        pictures.append(picture(browser))
        texts.append(browser.element(".numbers").text)
        browser.element("input[type=range]").send_keys(Keys.ARROW_RIGHT)
    assert len(set(pictures)) == len(set(texts)) == 3
    assert "state 4 of 4" in browser.element("output").text
    press(browser, Keys.HOME)
    assert (current(browser), picture(browser)) == (0, pictures[0])
    browser.run(f"{EXPLORER}.show(2)")
    press(browser, " ")
    browser.wait(lambda: current(browser) == 3 and browser.element("[data-action=play]").text == "▶")
    browser.element("[data-toggle=voids]").click()
    press(browser, " ")  # what has the focus is pressed, nothing is played
    assert browser.run(f"return [{EXPLORER}.shown.voids, {EXPLORER}.playing]") == [False, False]
    assert browser.errors() == [] and browser.loaded() == []


def test_pointing_at_a_contact_gives_the_force_of_the_library(browser, page, sweep):
    browser.open(page)
    network = jamlab.contacts(sweep[0])
    found = network.forces
    ends = browser.run(f"return {EXPLORER}.states.at(0).contacts.map(contact => [contact.start, contact.end])")
    for k in np.argsort(found.size)[[0, len(found.size) // 2, -1]]:
        one, other = np.array(ends[k])
        point_at(browser, *(0.6 * one + 0.4 * other))
        text = tip(browser)
        assert text.startswith("contact {} – {}".format(*network.pairs[k]))
        assert quantity(text, "force") == pytest.approx(found.size[k], rel=5e-4)
        assert quantity(text, "gap") == pytest.approx(found.gap[k], rel=5e-4)
        assert "[ε/l]" in text and "[l]" in text


def test_pointing_at_a_particle_gives_its_shape_contacts_and_area(browser, page, sweep):
    browser.open(page)
    press(browser, "f")  # contacts lie above particles
    network, packing = jamlab.contacts(sweep[0]), sweep[0]
    home = packing.centroids - np.floor(packing.centroids @ np.linalg.inv(packing.box)) @ packing.box
    beside = home + packing.box[0] * np.where(home[:, :1] < 0.5 * packing.box[0, 0], 1, -1)  # in the image next to it
    for k, place in ((3, home[3]), (int(home[:, 0].argmin()), beside[home[:, 0].argmin()])):
        point_at(browser, *place)
        text = tip(browser)
        assert text.startswith(f"droplet {k}, ")
        assert quantity(text, "𝒜") == pytest.approx(jamlab.shape_factors(packing)[k], rel=5e-4)
        assert quantity(text, "area") == pytest.approx(jamlab.particle_areas(packing)[k], rel=5e-4)
        assert quantity(text, "z") == np.sum(network.pairs[network.bearing] == k)


def test_every_toggle_changes_the_picture(browser, page, sweep):
    browser.open(page)
    browser.run(f"{EXPLORER}.show(1)")
    assert jamlab.contacts(sweep[1]).rattlers.any()
    for letter in "rfvcd":
        before = picture(browser)
        press(browser, letter)
        assert picture(browser) != before, letter
    legend = browser.element(".legend").text
    for words in ("void of 3", "set-Voronoi cells", "without the affine part (box: area 0.200 %"):
        assert words in legend
    assert browser.errors() == []


def test_zoom_and_pan_show_periodic_images(browser, page, sweep):
    browser.open(page)
    whole = picture(browser)
    press(browser, "+", "+")
    assert browser.run(f"return {EXPLORER}.view.zoom") == pytest.approx(1.25**2)
    assert picture(browser) != whole
    press(browser, "0")
    assert picture(browser) == whole
    colours = """const context = document.querySelector('canvas').getContext('2d');
        return values[0].map(([x, y]) => [...context.getImageData(x, y, 1, 1).data])"""
    browser.run(f"{EXPLORER}.toggle('forces', false); {EXPLORER}.zoomBy(0.3); {EXPLORER}.drawNow()")
    box, centres = sweep[0].box, sweep[0].centroids
    images = [centres[k] + u * box[0] + v * box[1] for k in range(4) for u, v in ((1, 0), (-1, 1), (1, -1))]
    places = [
        browser.run(f"return {EXPLORER}.view.toScreen(...values).map(Math.round)", *map(float, x)) for x in images
    ]
    seen = np.array(browser.run(colours, places))[:, :3]
    assert (np.ptp(seen, axis=1) > 10).all()  # a colour of a particle, neither paper nor ink


def test_fits_a_phone_and_takes_fingers(browser, page):
    browser.open(page, 375, 812, touch=True)
    assert browser.overhang() == 0
    corner = browser.run(
        "const box = document.querySelector('canvas').getBoundingClientRect(); return [box.left, box.top]"
    )

    def touch(kind, *fingers):
        points = [{"x": corner[0] + x, "y": corner[1] + y, "id": k} for k, (x, y) in enumerate(fingers)]
        browser.devtools("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    touch("touchStart", (150, 150))
    touch("touchEnd")
    assert re.match("contact|droplet|void", tip(browser))
    touch("touchStart", (150, 150), (200, 150))
    for spread in (10, 20, 30):
        touch("touchMove", (150 - spread, 150), (200 + spread, 150))
    touch("touchEnd")
    assert browser.run(f"return {EXPLORER}.view.zoom") == pytest.approx(110 / 50, rel=0.05)
    before = browser.run(f"return {EXPLORER}.view.middle")
    touch("touchStart", (150, 150))
    touch("touchMove", (190, 150))
    touch("touchEnd")
    assert browser.run(f"return {EXPLORER}.view.middle")[0] < before[0] - 0.02
    for name in ("voids", "cells", "displacements"):
        browser.run(f"{EXPLORER}.toggle('{name}')")
    browser.run(f"{EXPLORER}.show(3); {EXPLORER}.drawNow()")
    assert browser.overhang() == 0 and browser.errors() == []
