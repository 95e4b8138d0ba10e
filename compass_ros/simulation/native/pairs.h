// Forces between two bodies, at a distance or where two geoms touch. A part of fields.c.

// A force on one body at a point and its opposite on the other.
static void push_apart(const mjModel* m, mjData* d, const double force[3], const double* at, const double* other_at,
                       int body, int other) {
  mjtNum back[3] = {-force[0], -force[1], -force[2]}, none[3] = {0, 0, 0};
  apply_ft(m, d, force, none, at, body, d->qfrc_passive);
  apply_ft(m, d, back, none, other_at, other, d->qfrc_passive);
}

static const double* centre_of(const mjModel* m, const mjData* d, int body) {   // its origin, where it has no mass
  return (m->body_mass[body] > 0 ? d->xipos : d->xpos) + 3 * body;
}

// Between the centres of mass of two bodies.
static void between(const mjModel* m, mjData* d, const Term* term) {
  const double *p = term->number, *a = centre_of(m, d, term->id), *b = centre_of(m, d, term->dof);
  double apart[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, r = norm3(apart), k;   // k: pull over distance
  if (term->kind == TETHER) {   // p: stiffness, length
    k = r > p[1] ? p[0] * (r - p[1]) / r : 0;
  } else {                      // p: peak force, core radius; inverse square, softened, as ATTRACTION
    double c = r * r + p[1] * p[1];
    k = p[0] * 2.598076211353316 * p[1] * p[1] / (c * sqrt(c));
  }
  mjtNum force[3] = {k * apart[0], k * apart[1], k * apart[2]};
  push_apart(m, d, force, a, b, term->id, term->dof);
}

static int contacts_of(const mjData* d, const Term* term) {
  int count = 0;
  for (int i = 0; i < d->ncon; i++) count += acts_on(d->contact + i, term);
  return count;
}

// A pull along the normal while two geoms touch, shared by their contacts. p: force, hysteresis: the share of it that is
// missing while they come together. It changes over the speed that gravity gives in a step.
static void adhesion(const mjModel* m, mjData* d, const Term* term) {
  int count = contacts_of(d, term);
  double slow = norm3(m->opt.gravity) * m->opt.timestep + 1e-9, v[3];
  for (int i = 0; i < d->ncon; i++) {
    const mjContact* c = d->contact + i;
    if (!acts_on(c, term)) continue;
    double parting = contact_velocity(m, d, c, v);
    double f = term->number[0] / count * (1 - term->number[1] * 0.5 * (1 - parting / hypot(parting, slow)));
    mjtNum force[3] = {f * c->frame[0], f * c->frame[1], f * c->frame[2]};   // the normal points to the second geom
    push_apart(m, d, force, c->pos, c->pos, m->geom_bodyid[c->geom[0]], m->geom_bodyid[c->geom[1]]);
  }
}

// Inverse of a body's mass, of its mean moment of inertia, and gravity along a direction; zeros for what stands.
static void inertia_of(const mjModel* m, int body, const double* along, double out[3]) {
  const double *inertia = m->body_inertia + 3 * body, *g = m->opt.gravity;
  int moves = m->body_weldid[body] != 0;
  out[0] = moves ? 1 / m->body_mass[body] : 0;
  out[1] = moves ? 3 / (inertia[0] + inertia[1] + inertia[2]) : 0;
  out[2] = moves ? g[0] * along[0] + g[1] * along[1] + g[2] * along[2] : 0;
}

// A couple against the relative spin about axes in the plane of contact. p: lever of the load. The load is what MuJoCo's
// solver gives n contacts alike that carry two free bodies under gravity: (a_ref - a_free) / (R + n A), A the inverse
// mass along the normal, R the regularisation (a pyramid's is that of each edge). Faded in over the spin that the couple
// itself stops within a step.
static void rolling_resistance(const mjModel* m, mjData* d, const Term* term) {
  int count = contacts_of(d, term);
  for (int i = 0; i < d->ncon; i++) {
    const mjContact* c = d->contact + i;
    if (!acts_on(c, term)) continue;
    int a = m->geom_bodyid[c->geom[0]], b = m->geom_bodyid[c->geom[1]];
    double one[3], two[3], v[3], spin[3], about = 0;
    inertia_of(m, a, c->frame, one);
    inertia_of(m, b, c->frame, two);
    const double* kbip = d->efc_KBIP + 4 * c->efc_address;
    double reference = -kbip[0] * kbip[2] * (c->dist - c->includemargin) - kbip[1] * contact_velocity(m, d, c, v);
    int edges = m->opt.cone == mjCONE_PYRAMIDAL && c->dim > 1 ? 2 * (c->dim - 1) : 1;
    double load = (reference - (two[2] - one[2])) / (d->efc_R[c->efc_address] / edges + count * (one[0] + two[0]));
    if (load <= 0) continue;
    for (int k = 0; k < 3; k++) spin[k] = d->cvel[6 * b + k] - d->cvel[6 * a + k];
    for (int k = 0; k < 3; k++) about += spin[k] * c->frame[k];
    for (int k = 0; k < 3; k++) spin[k] -= about * c->frame[k];
    double couple = term->number[0] * load, stopped = couple * m->opt.timestep * (one[1] + two[1]), rate = norm3(spin);
    double scale = couple == 0 ? 0 : -couple / sqrt(rate * rate + stopped * stopped);
    mjtNum torque[3] = {scale * spin[0], scale * spin[1], scale * spin[2]}, none[3] = {0, 0, 0};
    mjtNum back[3] = {-torque[0], -torque[1], -torque[2]};
    apply_ft(m, d, none, torque, c->pos, b, d->qfrc_passive);
    apply_ft(m, d, none, back, c->pos, a, d->qfrc_passive);
  }
}
