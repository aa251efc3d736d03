"""A real browser without a screen, one for all tests of pages: Chromium with its driver, from PATH."""

import shutil
import time

import pytest

FLAGS = (
    *("--headless=new", "--no-sandbox", "--no-first-run"),
    *(f"--disable-{what}" for what in ("gpu", "background-networking", "component-update", "sync")),
)
PATIENCE = 5.0  # s until a page must show what is waited for


class Browser:
    """What the tests ask of a browser.

    Attributes:
        driver: selenium's.
    """

    def __init__(self, driver):
        self.driver = driver

    def open(self, path, width=1280, height=800, touch=False, media=None):
        """Open a file in a window of a size, as on a desk or in a hand; media: e.g. prefers-color-scheme -> dark."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": touch}
        self.devtools("Emulation.setDeviceMetricsOverride", **size)
        self.devtools("Emulation.setTouchEmulationEnabled", enabled=touch)
        features = [{"name": name, "value": value} for name, value in (media or {}).items()]
        self.devtools("Emulation.setEmulatedMedia", media="", features=features)
        self.driver.get_log("browser")  # of the page before
        self.driver.get(path.as_uri())
        self.run("await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def devtools(self, command, **values):
        """Call the protocol of the developer tools."""
        return self.driver.execute_cdp_cmd(command, values)

    def run(self, script, *values):
        """Run a script in the page, which may `await` and `return`; what it throws is raised here."""
        return self.driver.execute_script(
            f"const values = [...arguments]; return (async () => {{{script}}})()", *values
        )

    def errors(self):
        """Everything that the page wrote to the console since it was opened, errors among it."""
        return [entry["message"] for entry in self.driver.get_log("browser")]

    def loaded(self):
        """Addresses that the page fetched besides itself."""
        return self.run("return performance.getEntriesByType('resource').map(entry => entry.name)")

    def overhang(self):
        """Pixels by which the page is wider than its window."""
        return self.run("return document.documentElement.scrollWidth - document.documentElement.clientWidth")

    def element(self, selector):
        return self.driver.find_element("css selector", selector)

    def wait(self, condition):
        """Wait until a function gives what is true, and return that."""
        end = time.monotonic() + PATIENCE
        while not (found := condition()):
            assert time.monotonic() < end, "the page does not show what was waited for"
            time.sleep(0.02)
        return found


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """A `Browser`; the test is skipped where there is none."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    programs = [shutil.which(name) for name in ("chromium", "chromedriver")]
    if None in programs:
        pytest.skip("no chromium and chromedriver on PATH")
    options = webdriver.ChromeOptions()
    options.binary_location = programs[0]
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('chromium')}"):
        options.add_argument(flag)
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=programs[1]))
    driver.set_script_timeout(30)
    yield Browser(driver)
    driver.quit()
