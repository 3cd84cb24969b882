# %% [markdown]
# # The report
#
# Run `01_first_lab` first: this notebook takes your answers from there.

# %% imports
from labcourse.report.making import button

# %% [markdown]
# ## Table 1
#
# Carry over what you found; `lab.value("1.2", "k")` returns your answer.

# %% answer Table 1
k = lab.value("1.2", "k")
tau = lab.value("1.2", "tau")

# %% [markdown]
# ## The report
#
# Write its texts here, and save. Then make the document.

# %% front Report [markdown]
# * **Authors:**
# * **Figure 1.1:**
# * **Table 1:**
# * **[1]**

# %% words Report procedure [markdown]
# The heater was switched on with 5 V. The temperature was recorded for 100 s.

# %% words Report conclusion [markdown]
# The model holds for steps from rest. Losses that grow with the temperature are not in it.

# %% document tags=["illustration"]
button("Report", lab)
