# %% [markdown]
# # A mass on a spring
#
# A mass of half a kilogram hangs on a spring. It is pulled aside by 4 cm and let go.

# %% imports
import math

import numpy as np
import sympy
from springlab.plant import MASS

# %% [markdown]
# ## 1.1 The motion after release
#
# Let the mass go with `lab.bench().release()`, and keep the recording as `run`.

# %% answer 1.1
run = lab.bench().release()

# %% [markdown]
# ## 1.2 Stiffness
#
# Find the period in your recording, and from it the stiffness `k` of your spring in N/m. The mass is `MASS`.

# %% answer 1.2
x = run.channels["x"].values
falls = np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0))
crossings = (falls + x[falls] / (x[falls] - x[falls + 1])) * run.sample_time
period = (crossings[-1] - crossings[0]) / (len(crossings) - 1)
k = MASS * (2 * math.pi / period) ** 2

# %% [markdown]
# ## 1.3 Natural frequency
#
# Give the natural frequency as an expression, `formula`, in the symbols `k` and `m`; and as a number, `omega` in rad/s,
# for your own spring.

# %% answer 1.3
formula = sympy.sqrt(sympy.Symbol("k") / sympy.Symbol("m"))
omega = math.sqrt(k / MASS)

# %% [markdown]
# ## 1.4 What was left out
#
# Why would a real mass come to rest? Answer in a sentence or two, as the text `why`.

# %% answer 1.4
why = "Air and spring rub: each swing loses some energy, and the model has no term for that."
