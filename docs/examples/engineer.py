# Identify a bench, control it by LQR with and without an observer, and hold the sweep against the model.

import control
import matplotlib.pyplot as plt
import numpy as np

from rotflex import experiments, hil, identification, model, observers, response


class Observed:  # state feedback on the states that an observer estimates: it sees only the servo's encoder
    def reset(self):
        self.x = np.zeros((4, 1))

    def __call__(self, theta_ref, theta, alpha):
        self.x = self.x + L * (theta - self.x[0])  # correct by what was measured
        V_m = np.clip(K[0, 0] * theta_ref - K @ self.x, -bench.servo.V_max, bench.servo.V_max)
        self.x = sampled.A @ self.x + sampled.B * V_m  # predict the next sample
        return V_m


with hil.open("virtual:?seed=7") as bench:
    found = identification.frequency_response(experiments.sweep(bench))  # alpha/theta
    K_s = bench.joint.J_l * identification.resonance(found).value ** 2
    plant = model.state_space(bench.servo, bench.joint, K_s)  # vm → theta, alpha
    sampled = control.sample_system(plant, 0.002)
    K = control.lqr(plant, np.diag([400, 400, 1, 1]), 1)[0]
    L = observers.kalman_gain(sampled, np.diag([1e-6, 1e-6, 1e-2, 1e-2]), bench.servo.K_enc, servo_only=True)
    for controller in (K, Observed()):
        print(response.worst(response.measure(experiments.tracking(bench, controller))))
print("gain and phase margin:", control.margin(control.ss(plant.A, plant.B, K, 0))[:2])
measured, link = found.to_frd(band=(1, 5)), control.tf(plant[1, 0]) / control.tf(plant[0, 0])
control.bode_plot([measured, control.frd(link, measured.omega, name="model")], wrap_phase=True)
plt.show()
