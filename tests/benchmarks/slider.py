"""From a slider's key press to new pixels in the browser: `python tests/benchmarks/slider.py`.

The kit's `explore` against `interact` with `plt.show`, the same filter over the same log and the same
three panels, taking turns in one notebook.
"""

import sys
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from helpers import browser as lab

NAIVE = """
from ipywidgets import FloatLogSlider, interact
from labkit import metrics
from labkit.plots import plot_run

@interact(factor=FloatLogSlider(value=1, min=-3, max=3, step=0.1))
def naive(factor):
    history = replay(make_filter(KF, log, R=factor * log.R), log)
    fig, axes = plt.subplots(1, 3, figsize=(9.2, 3.9), width_ratios=[1.15, 1, 1])
    plot_run(axes, log, history)
    plt.show()
    print(metrics.summary(history, log))
"""
OURS = """
log = simulate(Robot((2, -2), np.diag([0.0625, 0.0625]), np.diag([0.04, 0.04]), rng=1), random_map(25, rng=1))
explore(KF, log, sliders=("R",))
"""

# Resolves with the milliseconds from the key press to the decoded new picture.
WATCH = """
output => new Promise(done => {
  const old = output.querySelector('img').src;
  let start = 0;
  output.addEventListener('keydown', () => { start = performance.now(); }, {once: true, capture: true});
  const watch = new MutationObserver(async () => {
    const image = output.querySelector('img');
    if (!start || !image || image.src === old) return;
    watch.disconnect();
    await image.decode();
    requestAnimationFrame(() => done(performance.now() - start));
  });
  watch.observe(output, {subtree: true, childList: true, attributes: true});
})
"""


def milliseconds(page, id, key):
    output = page.output(id)
    output.locator(".noUi-handle").first.focus()
    page.page.evaluate(f"output => {{ window.watched = ({WATCH})(output); }}", output.element_handle())
    page.page.keyboard.press(key)
    taken = page.page.evaluate("window.watched")
    page.page.wait_for_timeout(300)  # let the slower one finish what it still has to do
    return taken


def main(rounds=21):
    show = [id for id in lab.cells(lab.LAB1) if id.startswith("show")]
    ours, naive = show[0], show[1]
    with lab.chromium() as chromium, lab.jupyterlab() as server:
        changed = {ours.replace("-", "_"): OURS, naive.replace("-", "_"): NAIVE}
        page = lab.Page(chromium, server, lab.put_filled(server.root, lab.LAB1, **changed), height=2400)
        page.run("setup", "answer-stack", "answer-repeat", "answer-kf", ours, naive)
        for id in (ours, naive):
            page.output(id).locator("img").first.wait_for()
        times = {ours: [], naive: []}
        for k in range(rounds):
            for id, kept in times.items():
                kept.append(milliseconds(page, id, "ArrowRight" if k % 2 else "ArrowLeft"))
    quick, slow = median(times[ours]), median(times[naive])
    print(f"interact and plt.show / explore, slider to pixels: {slow / quick:.1f} (target at least 4)")
    print(
        f"   {slow:.0f} ms ({min(times[naive]):.0f} to {max(times[naive]):.0f}), "
        f"{quick:.0f} ms ({min(times[ours]):.0f} to {max(times[ours]):.0f})"
    )


if __name__ == "__main__":
    main()
