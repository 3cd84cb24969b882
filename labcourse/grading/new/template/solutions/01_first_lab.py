# %% [markdown]
# # An oven
#
# A heater warms an oven. You find a model of your own oven, and close a loop around it.

# %% imports
import matplotlib.pyplot as plt
import numpy as np
import sympy
from NAME.explorer import ModelExplorer
from NAME.plant import STEP

# %% [markdown]
# ## 1.1 A step of the heater
#
# Say what you expect: put a number in place of `None`, and run the cell before the experiment.

# %% predict tags=["open"]
lab.predict("1.1", half=None)  # s

# %% [markdown]
# Switch the heater on with `lab.bench().step()`, and keep the recording as `run`. Draw `run["T"]` against `run.time`,
# and keep the figure as `plot`.

# %% answer 1.1
run = lab.bench().step()
plot, axes = plt.subplots()
axes.plot(run.time, run["T"])
axes.set(xlabel="time (s)", ylabel="temperature above the room (K)")

# %% observed tags=["open"]
lab.observed("1.1", why="")

# %% [markdown]
# ## 1.2 Gain and time constant
#
# Find the gain `k` and the time constant `tau` of your oven. The step was `STEP`.

# %% answer 1.2
k = run["T"][-1] / STEP
tau = run.time[np.argmax(run["T"] >= (1 - np.exp(-1)) * run["T"][-1])]

# %% explorer tags=["illustration"]
if lab.given("1.1", run):
    display(ModelExplorer(run))

# %% [markdown]
# ## 1.3 A formula
#
# Give the temperature at the time `t` after a step of `u` volts, as an expression `rise` in `k`, `tau`, `u` and `t`.

# %% answer 1.3
# To sympy, names such as Q, S and I mean something else unless it is given symbols for them.
symbols = {symbol.name: symbol for symbol in sympy.symbols("k tau u t")}
rise = sympy.sympify("k * u * (1 - exp(-t / tau))", symbols)

# %% [markdown]
# ## 1.4 A model
#
# Write a function `model(t)` that returns the temperature of your oven, `t` seconds after a step of `STEP`.


# %% answer 1.4
def model(t):
    return k * STEP * (1 - np.exp(-t / tau))


# %% [markdown]
# ## 1.5 The closed loop
#
# The heater now gets $u = 0.2\,e + 0.05\int e\,dt$, where $e = r - T$. The states are $T$ and $\int e\,dt$. Give the
# matrix `A` of the closed loop, its poles `p`, and whether the temperature `overshoots`, `"yes"` or `"no"`.

# %% words 1.5 why [markdown]
# The poles are complex, so the temperature swings around its final value while it settles.

# %% answer 1.5
A = np.array([[-(1 + 0.2 * k) / tau, 0.05 * k / tau], [-1, 0]])
p = np.linalg.eigvals(A)
overshoots = "yes"
