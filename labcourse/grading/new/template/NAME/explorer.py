"""An explorer: sliders that change a model, drawn beside a recording."""

from labcourse.answers.forms import Recording
from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import Column, Panel, Scene, Slider, around
from NAME.plant import response


class ModelExplorer(Explorer):
    """The model of an oven beside a recording of it."""

    def __init__(self, run: Recording) -> None:
        self.run = run
        self.values = {"k": 5.0, "tau": 10.0}
        super().__init__()

    def set(self, name: str, value: float | str) -> None:
        """Take the value of a slider."""
        self.values[name] = float(value)

    def view(self) -> Scene:
        """Draw recording and model."""
        time, T, model = self.run.time, self.run["T"], response(**self.values, time=self.run.time)
        panel = Panel("temperature above the room (K)", (0.0, time[-1]), around(T, model), "time (s)")
        panel.line(time, T, "measured", "measured")
        panel.line(time, model, "model", "model")
        sliders = [
            Slider("k", "gain", "K/V", 1.0, 10.0, 0.1, self.values["k"]),
            Slider("tau", "time constant", "s", 1.0, 30.0, 0.1, self.values["tau"]),
        ]
        return Scene("Temperature of the oven and of the model against time.", [Column([panel])], [sliders])
