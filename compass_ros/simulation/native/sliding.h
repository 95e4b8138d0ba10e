// Friction of a body with what stands that depends on how and where it slides: MuJoCo's own contacts with another
// coefficient in each step, so that its solver keeps loads, sticking and cones as they are. A part of fields.c.

// What is added to the coefficient of a contact at `at`, where the slip is v: the isotropic part, and a tensor's two
// numbers [[one, two], [two, -one]] along x and y of the world.
typedef struct {
  double all, one, two;
} Coefficient;

static Coefficient coefficient(const Term* term, const double at[3], const double v[3]) {
  const double* p = term->number;
  if (term->kind == ANISOTROPIC) return (Coefficient){.one = p[0], .two = p[1]};
  return (Coefficient){.all = more_friction(term, at[0], at[1], norm3(v))};
}

static int slides(const Term* term) {
  if (term->object != BODY) return 0;
  switch (term->kind) {
    case STRIBECK: case FRICTION_PATCH: case FRICTION_GRADIENT: case ANISOTROPIC: return 1;
    default: return 0;
  }
}

// Rows of a contact's directions in the constraints' Jacobian; returns how many numbers each has (all degrees of freedom,
// or those that it has where it is sparse), 0 where these differ.
static int rows_of(const mjModel* m, mjData* d, int first, int count, double* row[]) {
  int sparse = is_sparse(m), n = m->nv;
  for (int k = 0; k < count; k++) {
    int own = sparse ? d->efc_J_rownnz[first + k] : m->nv;
    if (k && own != n) return 0;
    row[k] = d->efc_J + (sparse ? d->efc_J_rowadr[first + k] : (first + k) * m->nv);
    n = own;
  }
  return n;
}

// Gives a contact two coefficients of friction, of directions that are turned by an angle (of an elliptic cone alone, for a
// pyramid is another one when it is turned). Rows of an elliptic cone are n, t1, t2, ...; of a pyramid n + f1 t1,
// n - f1 t1, n + f2 t2, n - f2 t2, ... Regularisation as mj_makeConstraint has it: R of a direction goes with the inverse
// square of its coefficient; that of all edges of a pyramid with f1^2 (1 + f1^2).
static void set_friction(const mjModel* m, mjData* d, mjContact* c, double angle, double first, double second) {
  int at = c->efc_address, elliptic = m->opt.cone == mjCONE_ELLIPTIC;
  double before[2] = {c->friction[0], c->friction[1]}, after[2] = {fmax(first, mjMINMU), fmax(second, mjMINMU)};
  double cosine = cos(angle), sine = sin(angle), share = after[0] / before[0], *row[4];
  if (elliptic) {
    int n = angle == 0 ? 0 : rows_of(m, d, at + 1, 2, row);
    for (int i = 0; i < n; i++) {
      double one = row[0][i], two = row[1][i];
      row[0][i] = cosine * one + sine * two, row[1][i] = cosine * two - sine * one;
    }
    for (int k = 3; n && k < 6; k++) {
      double one = c->frame[k], two = c->frame[k + 3];
      c->frame[k] = cosine * one + sine * two, c->frame[k + 3] = cosine * two - sine * one;
    }
    d->efc_R[at + 2] = d->efc_R[at + 1] * after[0] * after[0] / (after[1] * after[1]);
    for (int k = 3; k < c->dim; k++) d->efc_R[at + k] *= share * share;
  } else {
    int n = rows_of(m, d, at, 4, row);
    for (int k = 0; k < 4; k += 2)
      for (int i = 0; i < n; i++) {
        double normal = (row[k][i] + row[k + 1][i]) / 2, along = (row[k][i] - row[k + 1][i]) / 2;
        along *= after[k / 2] / before[k / 2];
        row[k][i] = normal + along, row[k + 1][i] = normal - along;
      }
    double edge = share * share * (1 + after[0] * after[0]) / (1 + before[0] * before[0]);
    for (int k = 0; k < 2 * (c->dim - 1); k++) d->efc_R[at + k] *= edge;
  }
  for (int k = 0; k < (elliptic ? c->dim : 2 * (c->dim - 1)); k++) d->efc_D[at + k] = 1 / d->efc_R[at + k];
  c->mu *= share;
  c->friction[0] = after[0], c->friction[1] = after[1];
}

// Whether there was a contact to change.
static int sliding_friction(const mjModel* m, mjData* d, const Term* term) {
  int changed = 0;
  for (int i = 0; i < d->ncon; i++) {
    mjContact* c = d->contact + i;
    if (c->efc_address < 0 || c->dim < 3) continue;
    int a = m->body_weldid[m->geom_bodyid[c->geom[0]]], b = m->body_weldid[m->geom_bodyid[c->geom[1]]];
    int own = m->body_weldid[term->id];
    if ((a != own || b) && (b != own || a)) continue;
    double v[3];
    contact_velocity(m, d, c, v);
    Coefficient more = coefficient(term, c->pos, v);
    double first = c->friction[0] + more.all, second = c->friction[1] + more.all, angle = 0;
    double size = hypot(more.one, more.two);
    if (size > 0) {   // the tensor's first axis, in the contact's frame; half by the cone, which turns the force twice as
                      // far as the tensor does, and half by the direction of the slip
      double along = 0.5 * atan2(more.two, more.one), axis[3] = {cos(along), sin(along), 0}, t1 = 0, t2 = 0, v1 = 0;
      for (int k = 0; k < 3; k++)
        t1 += axis[k] * c->frame[3 + k], t2 += axis[k] * c->frame[6 + k], v1 += axis[k] * v[k];
      double slip2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2], by_slip = slip2 > 0 ? v1 * v1 / slip2 - 0.5 : 0;
      angle = atan2(t2, t1), first += size * (0.5 + by_slip), second -= size * (0.5 - by_slip);
    }
    set_friction(m, d, c, angle, first, second);
    changed = 1;
  }
  return changed;
}
