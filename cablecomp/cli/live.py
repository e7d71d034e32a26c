"""`cablecomp run --live`: puts the watch on the residual beside the loop, and its news among the run's events."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from cablecomp.config import JointConfig
from cablecomp.runtime.clock import Tick
from cablecomp.runtime.loop import Loop, RunStage
from cablecomp.runtime.results import RunReport
from cablecomp.runtime.run import Watch
from cablecomp.watch.live import LiveOptions, LiveWatch


class LiveRun:
    """Watches the one joint of a run; `watch` is called once a tick, after the commands went out."""

    def __init__(
        self,
        config: JointConfig,
        rate_Hz: float,
        folder: Path,
        beside: Watch,
        *,
        stepped: bool,
        options: LiveOptions | None = None,
    ) -> None:
        self._watch = LiveWatch(config, 1.0 / rate_Hz, folder, options, inline=stepped)
        self._beside = beside
        self._name = ""
        self._now_s = 0.0

    @property
    def kept(self) -> tuple[Path, ...]:
        """Recordings kept around mismatches so far."""
        return tuple(self._watch.kept)

    def watch(self, loop: Loop, tick: Tick) -> None:
        """Hand the last cycle to the watch while the joint is under control."""
        self._beside(loop, tick)
        view = loop.joints[0].view
        if view is None or loop.stage is not RunStage.RUNNING:
            return
        self._name, self._now_s = view.name, tick.now_s
        news = self._watch.take(view.sample, view.estimate, view.flags == 0)
        if news is not None:
            loop.events.add(tick.now_s, view.name, news)

    def finish(self, report: RunReport) -> RunReport:
        """The report with the news that came too late for the loop."""
        late = tuple((self._now_s, self._name, news) for news in self._watch.finish())
        return replace(report, events=report.events + late)
