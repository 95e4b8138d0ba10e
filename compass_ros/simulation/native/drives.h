// Forces of one actuator. A part of fields.c.

static double within(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

// Lets an actuator exert more than MuJoCo lets it.
static void exerts_more(const mjModel* m, mjData* d, int actuator, double force) {
  const int first = d->moment_rowadr[actuator], count = d->moment_rownnz[actuator];
  for (int k = first; k < first + count; k++) d->qfrc_passive[d->moment_colind[k]] += d->actuator_moment[k] * force;
}

// A position servo that does nothing while its error is within a band, and beyond it answers what is more, or with a share
// of the band at once: what it exerts then less what MuJoCo lets it exert. p: half of the band in units of the command, share.
static void servo_dead_band(const mjModel* m, mjData* d, const Term* term) {
  int i = term->id;
  const mjtNum *gain = m->actuator_gainprm + i * mjNGAIN, *bias = m->actuator_biasprm + i * mjNBIAS;
  double told = d->ctrl[i];
  if (m->actuator_ctrllimited[i])
    told = within(told, m->actuator_ctrlrange[2 * i], m->actuator_ctrlrange[2 * i + 1]);
  if (m->actuator_actnum[i]) told = d->act[m->actuator_actadr[i] + m->actuator_actnum[i] - 1];
  double error = told + (bias[0] + bias[1] * d->actuator_length[i]) / gain[0];
  double force = gain[0] * error + bias[2] * d->actuator_velocity[i];
  double band = term->number[0], missed = within(error, -band, band);
  double less = force - gain[0] * (missed == error ? missed : (1 - term->number[1]) * missed);
  if (m->actuator_forcelimited[i]) {
    const mjtNum* range = m->actuator_forcerange + 2 * i;
    force = within(force, range[0], range[1]);
    less = within(less, range[0], range[1]);
  }
  exerts_more(m, d, i, less - force);
}

// A drive whose force along its motion falls with its speed. p: one over its largest force, one over its speed without a load.
static void torque_speed(const mjModel* m, mjData* d, const Term* term) {
  const double *p = term->number, force = d->actuator_force[term->id], speed = d->actuator_velocity[term->id];
  if (p[0] <= 0 || force * speed <= 0) return;
  double limit = fmax(1 - fabs(speed) * p[1], 0) / p[0];
  if (fabs(force) > limit) exerts_more(m, d, term->id, copysign(limit, force) - force);
}

// What drives make of (n, steps) commands, in their place: they go to each as fast as they may, from rest at `before`, and
// slow down in time to stand there. p: of each, (n, 2), one over the largest rate and acceleration; 0 for no limit.
void compass_profile(int64_t n, int64_t steps, double* told, const double* p, const double* before, double dt) {
  for (int64_t i = 0; i < n; i++, p += 2) {
    const double fastest = p[0] > 0 ? 1 / p[0] : INFINITY, gain = p[1] > 0 ? dt / p[1] : INFINITY;  // of speed in a step
    double at = before[i], speed = 0;
    for (int64_t k = 0; k < steps; k++, told++) {
      const double ahead = *told - at, away = fabs(ahead), least = away / dt;
      // from the largest of these speeds on, `gain` less in each step leads to where it shall stand
      const double braking = p[1] > 0 ? 0.5 * gain * (sqrt(1 + 8 * least / gain) - 1) : INFINITY;
      const double wanted = copysign(fmin(fmin(least, braking), fastest), ahead);
      speed = within(wanted, speed - gain, speed + gain);
      at = speed == copysign(least, ahead) ? *told : at + speed * dt;
      *told = at;
    }
  }
}
