// Forces that MuJoCo does not know, added to qfrc_passive inside every step.
//
// MuJoCo calls compass_passive(model, data) once a step. It looks up the program registered for that model: a short list
// of terms, each one kind of force on one object with up to 8 numbers. A model without a program is left alone, so other
// models in the process are never touched. Programs are written by Python before a batch of rollouts starts and only read
// while it runs; the look-up needs no lock. Formulas, units and sources: simulation/effects/NAME.py, one file an effect.

#include <math.h>
#include <stdint.h>
#include <stddef.h>
#include <string.h>
#include <mujoco/mujoco.h>

enum { N_NUMBERS = 8, TABLE = 1 << 16 };
#define DAMPING_RATIO 0.05   // of the spring in a dry friction, as of those in joints (effects/joint_elasticity.py)

// Order and values are those of `Kind` in simulation/native/program.py.
enum Kind {
  TABLE_FRICTION = 1, UNIFORM = 2, VISCOUS = 3, QUADRATIC = 4, CROSSWIND = 5, FAN = 6, SWIRL = 7, ATTRACTION = 8,
  FRICTION_PATCH = 9, FRICTION_GRADIENT = 10, ANISOTROPIC = 11, STRIBECK = 12, COULOMB = 13, MAGNUS = 14, PULSATING = 15,
  RATE_RESTITUTION = 16, TANGENTIAL = 17, LIBRARY = 18, HAT = 19, TILT = 20, SPRING = 21,
  ASYMMETRIC = 22, LOAD_FRICTION = 23, COGGING = 24, GRAVITY_TILT = 25, WIND = 26, BUOYANCY = 27, SERVO_DEAD_BAND = 28,
  ADHESION = 29, ROLLING = 30, PAIR_ATTRACTION = 31, TETHER = 32, WINDUP = 33, TORQUE_SPEED = 34,
};

// What the object is, and so where its forces go: a body that slides along x and y, the same with a hinge about z after
// them, any other moving body, a joint of its own, an actuator, two geoms, two bodies.
enum Object { PLANAR = 0, BODY = 1, JOINT = 2, PLANAR_YAW = 3, ACTUATOR = 4, GEOM_PAIR = 5, BODY_PAIR = 6 };

typedef struct {
  int32_t kind, object;   // enum Kind, enum Object
  int32_t id, dof;        // body id (JOINT: joint id); first of its degrees of freedom. Of a pair: its two ids
  double number[N_NUMBERS];
} Term;

typedef struct {
  int64_t n;
  const Term* term;
} Program;

typedef struct {
  const mjModel* model;
  const Program* program;
} Entry;

typedef void (*ApplyFT)(const mjModel*, mjData*, const mjtNum*, const mjtNum*, const mjtNum*, int, mjtNum*);
typedef void (*FwdActuation)(const mjModel*, mjData*);
typedef void (*Rne)(const mjModel*, mjData*, int, mjtNum*);
typedef void (*SolveM)(const mjModel*, mjData*, mjtNum*, const mjtNum*, int);
typedef int (*IsSparse)(const mjModel*);
typedef void (*Stage)(const mjModel*, mjData*);

// Open addressing. DELETED keeps chains whole; where a chain ends in them, they turn back into empty slots. So a look-up
// that runs meanwhile for another model always finds it. Writers hold Python's lock.
static Entry entries[TABLE];
static int live;
static ApplyFT apply_ft;
static FwdActuation fwd_actuation;
static Rne rne;
static SolveM solve_m;
static IsSparse is_sparse;
static Stage island, project;
#define DELETED ((const mjModel*)entries)

static size_t home_of(const mjModel* model) { return ((uintptr_t)model >> 6) * 2654435761u % TABLE; }

static const Program* find(const mjModel* model) {
  for (size_t slot = home_of(model); entries[slot].model; slot = (slot + 1) % TABLE)
    if (entries[slot].model == model) return entries[slot].program;
  return NULL;
}

// Whose structures these are: mj_version() of the MuJoCo whose headers this was compiled with.
int compass_headers(void) { return mjVERSION_HEADER; }

// How many kinds of force there are: a library that was compiled from another source has other ones. 0 without them.
int compass_init(ApplyFT apply, FwdActuation actuation, Rne bias, SolveM solve, IsSparse sparse, Stage islands,
                 Stage projects) {
  apply_ft = apply;
  fwd_actuation = actuation;
  rne = bias;
  solve_m = solve;
  is_sparse = sparse;
  island = islands;
  project = projects;
  return TORQUE_SPEED;
}

// Gives a model its program. Returns 0 where it has one already, or where three quarters of the table are taken.
int compass_register(const mjModel* model, const Program* program) {
  if (find(model) || live >= TABLE / 4 * 3) return 0;
  size_t slot = home_of(model);
  while (entries[slot].model && entries[slot].model != DELETED) slot = (slot + 1) % TABLE;
  entries[slot].program = program;
  entries[slot].model = model;
  live++;
  return 1;
}

// Takes a model's program away; one that has none is left alone.
void compass_forget(const mjModel* model) {
  size_t slot = home_of(model);
  while (entries[slot].model && entries[slot].model != model) slot = (slot + 1) % TABLE;
  if (!entries[slot].model) return;
  entries[slot].model = DELETED;
  live--;
  if (entries[(slot + 1) % TABLE].model) return;
  for (; entries[slot].model == DELETED; slot = (slot + TABLE - 1) % TABLE) entries[slot].model = NULL;
}

// --- forces on one object -----------------------------------------------------------------------------------------------

// What a force may depend on: position [m] and velocity [m/s] in the world (JOINT: angle and rate in [0]), inertia.
// Numbers of a joint are forces and torques themselves: its mass is 1 and it has no weight. `load`: what drives a joint.
// `way`: into which direction a joint would move if its friction did not hold it, 1 or -1; 0: as its velocity has it. Of a
// body in space also its spin and gravity, in the world.
typedef struct {
  double x, y, vx, vy, vz, speed, mass, weight, time, way, load;
  double spin[3], gravity[3];
} State;

typedef struct {
  double x, y, z;
} Force;

// Against the velocity, smooth through zero over the creep speed; of a joint at most, against the way it would move.
static Force along(const State* s, double magnitude, double creep) {
  if (s->way) return (Force){-magnitude * s->way, 0, 0};
  double rate = sqrt(s->speed * s->speed + creep * creep), k = rate > 0 ? -magnitude / rate : 0;
  return (Force){k * s->vx, k * s->vy, k * s->vz};
}

static double falling(double beyond, double tail) {   // exp(-beyond) without a tail, 1 / (1 + beyond) with a tail of 1
  return exp(tail * fabs(beyond) < 1e-8 ? -beyond : -log1p(tail * beyond) / tail);
}

static double norm3(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

// Gravity turned by two small angles, less gravity [m/s^2]: pushes along two axes across it, those of the world's x and y
// where gravity points down z.
static Force tilted(const double g[3], double one, double two) {
  double size = norm3(g), angle = sqrt(one * one + two * two);
  if (size == 0 || angle == 0) return (Force){0, 0, 0};
  double up[3] = {-g[0] / size, -g[1] / size, -g[2] / size}, a[3], b[3];
  int seed = fabs(up[0]) < 0.9 ? 0 : 1;
  for (int k = 0; k < 3; k++) a[k] = (k == seed) - up[seed] * up[k];
  double length = norm3(a), along = size * (cos(angle) - 1), across = size * sin(angle) / angle;
  for (int k = 0; k < 3; k++) a[k] /= length;
  for (int k = 0; k < 3; k++) b[k] = up[(k + 1) % 3] * a[(k + 2) % 3] - up[(k + 2) % 3] * a[(k + 1) % 3];
  double f[3];
  for (int k = 0; k < 3; k++) f[k] = -along * up[k] + across * (one * a[k] + two * b[k]);
  return (Force){f[0], f[1], f[2]};
}

// By how much a coefficient of friction is larger at a place and a speed.
static double more_friction(const Term* term, double x, double y, double speed) {
  const double* p = term->number;
  switch (term->kind) {
    case STRIBECK: return p[0] * exp(-speed * speed / (p[3] * p[3]));
    case FRICTION_PATCH: {
      double rx = x - p[1], ry = y - p[2];
      return p[0] / (1 + exp(10 * (sqrt(rx * rx + ry * ry) / p[3] - 1)));
    }
    default: return p[0] * x + p[1] * y;   // FRICTION_GRADIENT
  }
}

static Force evaluate(const Term* term, const State* s) {
  const double* p = term->number;
  const double rx = s->x - p[1], ry = s->y - p[2];   // used by the fields around a point
  const double r = sqrt(rx * rx + ry * ry);
  switch (term->kind) {
    case TABLE_FRICTION:   // p: friction, creep speed, share of the weight that the table carries
      return along(s, p[0] * s->weight * p[2], p[1]);
    case COULOMB:          // p: friction (JOINT: force), creep speed (JOINT: time constant, for `hold`), share of the weight
      return term->object == JOINT ? along(s, p[0], 0) : along(s, p[0] * s->weight * p[2], p[1]);
    case STRIBECK:         // p: extra friction at rest, creep speed, share of the weight, Stribeck speed (JOINT: anchor or -1)
      return along(s, more_friction(term, s->x, s->y, s->speed) * (term->object == JOINT ? 1.0 : s->weight * p[2]), p[1]);
    case PULSATING:        // p: cosine and sine amplitude, creep speed, share of the weight, frequency
      return along(s, (p[0] * cos(2 * M_PI * p[4] * s->time) + p[1] * sin(2 * M_PI * p[4] * s->time)) * s->weight * p[3],
                   p[2]);
    case FRICTION_PATCH:   // p: extra friction, centre x, y, radius, creep speed, share of the weight
      return along(s, more_friction(term, s->x, s->y, s->speed) * s->weight * p[5], p[4]);
    case FRICTION_GRADIENT:  // p: gradient along x, along y, creep speed, share of the weight
      return along(s, more_friction(term, s->x, s->y, s->speed) * s->weight * p[3], p[2]);
    case ANISOTROPIC: {    // p: extra friction along x (less along y), along the diagonal, creep speed, share of the weight
      double k = -s->weight * p[3] / sqrt(s->speed * s->speed + p[2] * p[2]);
      return (Force){k * (p[0] * s->vx + p[1] * s->vy), k * (p[1] * s->vx - p[0] * s->vy), 0};
    }
    case UNIFORM:          // p: acceleration x, y, z
      return (Force){s->mass * p[0], s->mass * p[1], s->mass * p[2]};
    case TILT:             // p: slope x, y
      return (Force){s->weight * p[0], s->weight * p[1], 0};
    case VISCOUS:          // p: rate
      return (Force){-s->mass * p[0] * s->vx, -s->mass * p[0] * s->vy, -s->mass * p[0] * s->vz};
    case QUADRATIC: {      // p: inverse length
      double k = -s->mass * p[0] * s->speed;
      return (Force){k * s->vx, k * s->vy, k * s->vz};
    }
    case CROSSWIND: {      // p: acceleration at rest x, y, speed of the air
      double a = sqrt(p[0] * p[0] + p[1] * p[1]);
      if (a == 0) return (Force){0, 0, 0};
      double ux = p[2] * p[0] / a - s->vx, uy = p[2] * p[1] / a - s->vy;
      double k = s->mass * a * sqrt(ux * ux + uy * uy) / (p[2] * p[2]);
      return (Force){k * ux, k * uy, 0};
    }
    case FAN:              // p: peak acceleration, centre x, y, radius of the peak, tail
    case SWIRL: {
      double k = s->mass * p[0] / p[3] * falling(0.5 * (r * r / (p[3] * p[3]) - 1.0), p[4]);
      return term->kind == FAN ? (Force){k * rx, k * ry, 0} : (Force){-k * ry, k * rx, 0};
    }
    case ATTRACTION: {     // p: peak acceleration, centre x, y, core radius; softened inverse square, peak at radius / sqrt(2)
      double c = r * r + p[3] * p[3], k = -s->mass * p[0] * 2.598076211353316 * p[3] * p[3] / (c * sqrt(c));
      return (Force){k * rx, k * ry, 0};
    }
    case MAGNUS:           // p: rate (BODY: share of spin x velocity, and a vector that the spin is not known of)
      if (term->object == BODY) {
        double x = s->mass * (p[0] * s->spin[0] + p[1]), y = s->mass * (p[0] * s->spin[1] + p[2]);
        double z = s->mass * (p[0] * s->spin[2] + p[3]);
        return (Force){y * s->vz - z * s->vy, z * s->vx - x * s->vz, x * s->vy - y * s->vx};
      }
      return (Force){-s->mass * p[0] * s->vy, s->mass * p[0] * s->vx, 0};
    case LIBRARY: {        // p: coefficient, powers of x, y, vx, vy, speed; component (0 x, 1 y, 2 against the velocity)
      double value = s->mass * p[0] * pow(s->x, p[1]) * pow(s->y, p[2]) * pow(s->vx, p[3]) * pow(s->vy, p[4]) *
                     pow(s->speed, p[5]);
      if (p[6] == 2) return along(s, value, term->object == JOINT ? 0 : 1e-3);
      return p[6] == 0 ? (Force){value, 0, 0} : (Force){0, value, 0};
    }
    case SPRING: {         // p: stiffness, rest, softening, slack
      double away = s->x - p[1], turn = p[2] * away;
      double pull = p[2] > 0 ? sin(turn) / p[2] : p[2] < 0 ? sinh(turn) / p[2] : away;
      return (Force){-s->mass * p[0] * pull * (1 - p[3] * fmax(p[2], 0) * cos(turn)), 0, 0};
    }
    case ASYMMETRIC:       // p: extra friction forwards
      return (s->way ? s->way : s->vx) > 0 ? along(s, p[0], 0) : (Force){0, 0, 0};
    case LOAD_FRICTION: {  // p: friction as a share of the load, what is more at rest, speed over which that fades
      double more = p[1] > 0 ? p[1] * exp(-s->speed * s->speed / (p[2] * p[2])) : 0;
      return along(s, (p[0] + more) * fabs(s->load), 0);
    }
    case COGGING: {        // p: cosine and sine amplitude, periods per turn, amplitudes of the second and third harmonic
      double c = cos(p[2] * s->x), z = sin(p[2] * s->x), twice = 2 * c * c - 1;
      double more = p[5] * c * (2 * twice - 1) + p[6] * z * (2 * twice + 1);
      return (Force){p[0] * c + p[1] * z + p[3] * twice + p[4] * 2 * z * c + more, 0, 0};
    }
    case GRAVITY_TILT: {   // p: two angles
      Force f = tilted(s->gravity, p[0], p[1]);
      return (Force){s->mass * f.x, s->mass * f.y, s->mass * f.z};
    }
    case WIND: {           // p: velocity of the air x, y, z, drag over mass and squared speed
      double u[3] = {p[0] - s->vx, p[1] - s->vy, p[2] - s->vz}, moving = s->mass * p[3] * norm3(u);
      double resting = s->mass * p[3] * s->speed;
      return (Force){moving * u[0] + resting * s->vx, moving * u[1] + resting * s->vy, moving * u[2] + resting * s->vz};
    }
    case BUOYANCY: {       // p: share of the weight
      double k = -s->mass * p[0];
      return (Force){k * s->gravity[0], k * s->gravity[1], k * s->gravity[2]};
    }
    case HAT: {            // p: acceleration x, y (JOINT: force), time of the peak, half-width in time
      double k = s->mass * fmax(0, 1 - fabs(s->time - p[2]) / p[3]);
      return (Force){k * p[0], k * p[1], 0};
    }
    default:
      return (Force){0, 0, 0};
  }
}

// The forces of n terms in n states, six numbers each (x, y, vx, vy, mass, time), on bodies in the plane or on joints;
// (n, 2) out.
void compass_evaluate(int64_t n, const Term* term, const double* state, double gravity, double* out) {
  for (int64_t i = 0; i < n; i++) {
    const double* row = state + 6 * i;
    State s = {.x = row[0], .y = row[1], .vx = row[2], .vy = row[3], .mass = row[4], .time = row[5]};
    s.speed = sqrt(s.vx * s.vx + s.vy * s.vy);
    s.weight = s.mass * gravity;
    if (term[i].object == JOINT) s.mass = 1, s.weight = 0;
    Force f = evaluate(term + i, &s);
    out[2 * i] = f.x;
    out[2 * i + 1] = f.y;
  }
}

static void body_velocity(const mjModel* m, const mjData* d, int body, const double* at, double out[3]) {
  // velocity of the body's material point `at` [m/s]; cvel is (angular, linear) about the subtree's centre of mass
  const double* w = d->cvel + 6 * body;
  const double* c = d->subtree_com + 3 * m->body_rootid[body];
  double r[3] = {at[0] - c[0], at[1] - c[1], at[2] - c[2]};
  out[0] = w[3] + w[1] * r[2] - w[2] * r[1];
  out[1] = w[4] + w[2] * r[0] - w[0] * r[2];
  out[2] = w[5] + w[0] * r[1] - w[1] * r[0];
}

// Whether it is a friction that holds a joint.
static int dry(const Term* term) {
  if (term->object != JOINT) return 0;
  switch (term->kind) {
    case COULOMB: case STRIBECK: case ASYMMETRIC: case LOAD_FRICTION: return 1;
    case LIBRARY: return term->number[6] == 2;
    default: return 0;
  }
}

static State joint_state(const mjModel* m, const mjData* d, const Term* term) {
  double v = d->qvel[term->dof];
  return (State){.x = d->qpos[m->jnt_qposadr[term->id]], .vx = v, .speed = fabs(v), .mass = 1, .time = d->time,
                 .load = d->qfrc_actuator[term->dof] + d->qfrc_applied[term->dof]};
}

static void push(const mjModel* m, mjData* d, const Term* term) {
  double* passive = d->qfrc_passive + term->dof;
  if (term->object == JOINT) {
    State s = joint_state(m, d, term);
    passive[0] += evaluate(term, &s).x;
    return;
  }
  const double* v = d->qvel + term->dof;
  const double* com = d->xipos + 3 * term->id;
  double arm[2] = {0, 0};   // from the body's origin to its centre of mass
  State s = {.x = com[0], .y = com[1], .mass = m->body_mass[term->id], .time = d->time};
  s.weight = -s.mass * m->opt.gravity[2];
  if (term->object == BODY) {
    double velocity[3];
    body_velocity(m, d, term->id, com, velocity);
    s.vx = velocity[0];
    s.vy = velocity[1];
    s.vz = velocity[2];
    memcpy(s.spin, d->cvel + 6 * term->id, sizeof s.spin);
    memcpy(s.gravity, m->opt.gravity, sizeof s.gravity);
  } else {
    double rate = term->object == PLANAR_YAW ? v[2] : 0;
    for (int k = 0; k < 2; k++) arm[k] = com[k] - d->xpos[3 * term->id + k];
    s.vx = v[0] - rate * arm[1];
    s.vy = v[1] + rate * arm[0];
  }
  s.speed = sqrt(s.vx * s.vx + s.vy * s.vy + s.vz * s.vz);
  Force f = evaluate(term, &s);
  if (term->object == BODY) {
    mjtNum force[3] = {f.x, f.y, f.z}, torque[3] = {0, 0, 0};
    apply_ft(m, d, force, torque, com, term->id, d->qfrc_passive);
    return;
  }
  passive[0] += f.x;
  passive[1] += f.y;
  if (term->object == PLANAR_YAW) passive[2] += arm[0] * f.y - arm[1] * f.x;
}

// --- contacts -----------------------------------------------------------------------------------------------------------

// Velocity of the contact's second body against its first: tangential part in v, returns the part along the normal.
static double contact_velocity(const mjModel* m, const mjData* d, const mjContact* c, double v[3]) {
  double va[3], normal = 0;
  body_velocity(m, d, m->geom_bodyid[c->geom[0]], c->pos, va);
  body_velocity(m, d, m->geom_bodyid[c->geom[1]], c->pos, v);
  for (int k = 0; k < 3; k++) {
    v[k] -= va[k];
    normal += v[k] * c->frame[k];
  }
  for (int k = 0; k < 3; k++) v[k] -= normal * c->frame[k];
  return normal;
}

static int between_geoms(const mjContact* c, const Term* term) {
  return (c->geom[0] == term->id && c->geom[1] == term->dof) || (c->geom[0] == term->dof && c->geom[1] == term->id);
}

// Whether a law of contacts acts on one that is solved: on all, or on those of its pair of geoms.
static int acts_on(const mjContact* c, const Term* term) {
  return c->efc_address >= 0 && (term->object != GEOM_PAIR || between_geoms(c, term));
}

// Damping that grows with the speed along the normal; MuJoCo reads efc_KBIP right after the passive forces.
static void rate_dependent_restitution(const mjModel* m, mjData* d, const Term* term) {
  for (int i = 0; i < d->ncon; i++) {
    const mjContact* c = d->contact + i;
    double v[3];
    if (!acts_on(c, term)) continue;
    d->efc_KBIP[4 * c->efc_address + 1] *= 1.0 + term->number[0] * fabs(contact_velocity(m, d, c, v));
  }
}

// Coulomb friction between the rims. The normal force is what MuJoCo's solver will give a contact that is alone.
static void tangential_impulse(const mjModel* m, mjData* d, const Term* term) {
  for (int i = 0; i < d->ncon; i++) {
    const mjContact* c = d->contact + i;
    if (!acts_on(c, term)) continue;
    int a = m->geom_bodyid[c->geom[0]], b = m->geom_bodyid[c->geom[1]];
    double inverse = 0;
    if (m->body_weldid[a]) inverse += 1 / m->body_mass[a];
    if (m->body_weldid[b]) inverse += 1 / m->body_mass[b];
    const double* kbip = d->efc_KBIP + 4 * c->efc_address;
    double v[3], normal = contact_velocity(m, d, c, v);
    double reference = -kbip[0] * kbip[2] * (c->dist - c->includemargin) - kbip[1] * normal;
    double load = reference / (inverse + d->efc_R[c->efc_address]);
    if (load <= 0) continue;
    double slip2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    double scale = -term->number[0] * load / sqrt(slip2 + term->number[1] * term->number[1]);
    mjtNum force[3] = {scale * v[0], scale * v[1], scale * v[2]}, back[3] = {-force[0], -force[1], -force[2]};
    mjtNum none[3] = {0, 0, 0};
    apply_ft(m, d, force, none, c->pos, b, d->qfrc_passive);
    apply_ft(m, d, back, none, c->pos, a, d->qfrc_passive);
  }
}

#include "pairs.h"
#include "sliding.h"
#include "drives.h"

// How much softer a gear is about no twist (effects/joint_elasticity.py). number[4]: the tendon between rotor and joint, which
// has the spring: its actfrcrange is windup and windup_force.
static void windup(const mjModel* m, mjData* d, const Term* term) {
  int tendon = (int)term->number[4], rotor = m->wrap_objid[m->tendon_adr[tendon]];
  const mjtNum* p = m->tendon_actfrcrange + 2 * tendon;
  double stiffness = m->tendon_stiffness[tendon];
  if (stiffness <= 0 || p[1] <= 0) return;
  double back = p[0] * p[1] * tanh(stiffness * d->ten_length[tendon] / p[1]);
  d->qfrc_passive[m->jnt_dofadr[rotor]] += back;
  d->qfrc_passive[term->dof] -= back;
}

// --- what MuJoCo calls --------------------------------------------------------------------------------------------------

// Solves a (n, n) symmetric positive definite system in place by Cholesky's factors; `x` holds the right side, then the
// solution.
static void solve_small(int n, double* a, double* x) {
  for (int i = 0; i < n; i++) {
    for (int j = 0; j <= i; j++) {
      double sum = a[i * n + j];
      for (int k = 0; k < j; k++) sum -= a[i * n + k] * a[j * n + k];
      a[i * n + j] = i == j ? sqrt(sum) : sum / a[j * n + j];
    }
    for (int k = 0; k < i; k++) x[i] -= a[i * n + k] * x[k];
    x[i] /= a[i * n + i];
  }
  for (int i = n - 1; i >= 0; i--) {
    for (int k = i + 1; k < n; k++) x[i] -= a[k * n + i] * x[k];
    x[i] /= a[i * n + i];
  }
}

// Let an anchor, which nothing else moves, have a rate after the step.
static void carry_anchor(const mjModel* m, mjData* d, int dof, double rate) {
  double own = d->M[m->M_rowadr[dof] + m->M_rownnz[dof] - 1];
  d->qfrc_passive[dof] += own * (rate - d->qvel[dof]) / m->opt.timestep;   // it has no weight
}

// Dry frictions of joints: the forces between their two limits with which these are at rest after the step. They come
// after all other forces, for a joint is held against these. Those that each joint alone would not be held by are at a
// limit at first; held ones beyond a limit go there, and are held again where they would be pushed back (block pivoting,
// Judice and Pires 1994, which ends after two or three rounds). A soft one is MuJoCo's own constraint of frictionloss
// (documentation, "Computation"): a + v / tau + R F = 0 with R = (1 - d) / d of the joint's inverse inertia.
// Where there is such a law all joints' frictionloss is solved for here and none is left for MuJoCo, which would move what
// is held. That of a joint with a law is in its limits, and holds or creeps with it; that of others is as soft as it is,
// and so is one that a law only skews.
// With an anchor (cells/rotors.py) a friction is a spring before it slides, stepped by its own implicit formula: the force
// is -k z - c z', linear in the rate after the step about the one before, and the anchor moves by what does not bend it.
// Its range is how far the spring bends at rest, k its largest friction over that.
// `most`: how many terms of a program are such frictions.
static void hold(const mjModel* m, mjData* d, const Program* program, int most) {
  int nv = m->nv, n = 0, any = 0, taken = 0;
  most += d->nf;
  int dofs[most], held[most], solved[most], row[most];   // row: of MuJoCo's own constraint, where it is all there is
  double load[nv], total[nv], after[nv], unit[nv];
  double low[most], high[most], tau[most], give[most];   // of a soft friction: time constant [s], R
  double drift[most];   // the acceleration that is asked for where no force is
  double idle[most];    // the force at which a joint rests that nothing pulls
  int firm[most];       // whether a law has a friction of its own there
  int anchor[most];     // its degree of freedom, or -1
  double rest[most], bent[most], rate[most];   // the largest friction at rest; range of a spring; rate of its anchor
  double force[most], limit[most], right[most], column[most * nv], matrix[most * most];
  fwd_actuation(m, d);   // MuJoCo computes these two after the passive forces
  rne(m, d, 0, d->qfrc_bias);
  for (int k = 0; k < nv; k++) {
    load[k] = d->qfrc_passive[k] + d->qfrc_actuator[k] + d->qfrc_applied[k] - d->qfrc_bias[k];
    unit[k] = 0;
  }
  for (int64_t t = 0; t < program->n; t++) {
    const Term* term = program->term + t;
    if (!dry(term)) continue;
    int i = 0;
    while (i < n && dofs[i] != term->dof) i++;
    if (i == n) dofs[n++] = term->dof, low[i] = high[i] = tau[i] = solved[i] = rest[i] = firm[i] = 0, row[i] = anchor[i] = -1;
    firm[i] |= term->kind != ASYMMETRIC;
    if (term->kind == COULOMB) tau[i] = fmax(tau[i], term->number[1]);
    State s = joint_state(m, d, term);
    s.way = 1, low[i] += evaluate(term, &s).x;
    s.way = -1, high[i] += evaluate(term, &s).x;
    s.speed = 0, rest[i] += evaluate(term, &s).x;
    int of = term->kind == STRIBECK ? (int)term->number[4] : -1;
    if (of >= 0 && m->jnt_range[2 * of + 1] > 0) anchor[i] = m->jnt_dofadr[of], bent[i] = m->jnt_range[2 * of + 1];
    any |= low[i] || high[i] || anchor[i] >= 0;
  }
  if (!any) return;
  for (int r = d->ne; r < d->ne + d->nf; r++) {
    if (d->efc_type[r] != mjCNSTR_FRICTION_DOF) continue;
    int i = 0;
    while (i < n && dofs[i] != d->efc_id[r]) i++;
    if (i == n) dofs[n++] = d->efc_id[r], low[i] = high[i] = solved[i] = rest[i] = firm[i] = 0, anchor[i] = -1;
    double damping = d->efc_KBIP[4 * r + 1];   // of 0 no speed is pulled towards zero
    if (!firm[i] || (!low[i] && !high[i])) row[i] = r, tau[i] = damping > 0 ? 1 / damping : mjMAXVAL;
    low[i] -= d->efc_frictionloss[r], high[i] += d->efc_frictionloss[r], rest[i] += d->efc_frictionloss[r];
    d->efc_frictionloss[r] = 0;
    if (d->nisland) d->iefc_frictionloss[d->map_efc2iefc[r]] = 0;   // where islands are solved, theirs is a copy
    taken++;
  }
  if (taken == d->nefc) d->nf = d->nefc = d->nisland = 0;   // nothing is left for the solver, which would start all the same
  for (int i = 0; i < n; i++) {
    int dof = dofs[i], own = m->M_rowadr[dof] + m->M_rownnz[dof] - 1;   // the diagonal is the last of a row
    double v = d->qvel[dof], hard = m->dof_solimp[mjNIMP * dof], longer = fmax(tau[i], m->opt.timestep);
    if (low[i] > high[i]) low[i] = high[i] = v > 0 ? low[i] : v < 0 ? high[i] : 0;   // less than none: along the motion
    give[i] = (row[i] < 0 ? (1 - hard) / hard * m->dof_invweight0[dof] : d->efc_R[row[i]]) * tau[i] / longer;
    tau[i] = longer;
    drift[i] = v / tau[i];
    if (rest[i] <= 0) anchor[i] = -1;   // no friction to bend a spring
    if (anchor[i] >= 0) {
      double step = m->opt.timestep, k = rest[i] / bent[i], most_bent = (high[i] - low[i]) / 2 / k;
      double at = d->qpos[m->jnt_qposadr[m->dof_jntid[dof]]] - d->qpos[m->jnt_qposadr[m->dof_jntid[anchor[i]]]];
      int rigid = k * step * step > d->M[own];   // stiffer than a step shows
      double z = rigid ? 0 : within(at, -bent[i], bent[i]), end = rigid ? 0 : v < 0 ? -most_bent : most_bent;
      double left = exp(-fabs(v) * step / most_bent), bending = (end - z) * (1 - left) / step;
      rate[i] = v + (at - z) / step - bending;
      if (!rigid) {
        double firm = fmax(1e-6, (v < 0 ? z - end : end - z) / most_bent * left);
        double stiff = k * step + 2 * DAMPING_RATIO * sqrt(k * d->M[own]);
        tau[i] = step, give[i] = 1 / (step * firm * stiff), row[i] = -1;
        drift[i] = (k * z + stiff * bending) * give[i];
      }
    }
    idle[i] = row[i] < 0 ? (low[i] + high[i]) / 2 : 0;
    double own_give = d->M[own] * give[i];
    double stop = (own_give * idle[i] - d->M[own] * drift[i] - load[dof]) / (1 + own_give);
    limit[i] = stop < low[i] ? low[i] : stop > high[i] ? high[i] : NAN;   // not a number: held
  }
  for (int round = 0, changed = 1; changed && round < 3 * n + 3; round++) {
    int h = 0;
    memcpy(total, load, sizeof total);
    for (int i = 0; i < n; i++)
      if (isnan(limit[i])) held[h++] = i;
      else total[dofs[i]] += force[i] = limit[i];
    solve_m(m, d, after, total, 1);
    for (int r = 0; r < h; r++) {
      int i = held[r], dof = dofs[i];
      if (!solved[i]) unit[dof] = 1, solve_m(m, d, column + i * nv, unit, 1), unit[dof] = 0, solved[i] = 1;
      right[r] = -drift[i] - after[dof] + give[i] * idle[i];
    }
    for (int r = 0; r < h; r++)
      for (int c = 0; c < h; c++)
        matrix[r * h + c] = column[held[c] * nv + dofs[held[r]]] + (r == c ? give[held[r]] : 0);
    solve_small(h, matrix, right);
    changed = 0;
    for (int r = 0; r < h; r++) {
      int i = held[r];
      force[i] = right[r];
      for (int k = 0; k < nv; k++) after[k] += column[i * nv + k] * force[i];
      if (force[i] < low[i] || force[i] > high[i]) limit[i] = force[i] < low[i] ? low[i] : high[i], changed = 1;
    }
    if (changed) continue;
    for (int i = 0; i < n; i++) {
      double moving = drift[i] + after[dofs[i]];
      if (isnan(limit[i]) || low[i] == high[i]) continue;
      if (limit[i] == low[i] ? moving < give[i] * (idle[i] - low[i]) : moving > give[i] * (idle[i] - high[i]))
        limit[i] = NAN, changed = 1;
    }
  }
  for (int i = 0; i < n; i++) {
    d->qfrc_passive[dofs[i]] += fmax(low[i], fmin(high[i], force[i]));
    if (anchor[i] >= 0) carry_anchor(m, d, anchor[i], rate[i] + m->opt.timestep * after[dofs[i]]);
  }
}

void compass_passive(const mjModel* m, mjData* d) {
  const Program* program = find(m);
  if (!program) return;
  int holding = 0, changed = 0, driven = 0;
  for (int64_t i = 0; i < program->n; i++) {
    const Term* term = program->term + i;
    switch (term->kind) {
      case RATE_RESTITUTION: rate_dependent_restitution(m, d, term); break;
      case TANGENTIAL: tangential_impulse(m, d, term); break;
      case ADHESION: adhesion(m, d, term); break;
      case ROLLING: rolling_resistance(m, d, term); break;
      case PAIR_ATTRACTION: case TETHER: between(m, d, term); break;
      case WINDUP: windup(m, d, term); break;
      case TORQUE_SPEED:
        if (!driven++) fwd_actuation(m, d);   // MuJoCo computes it after the passive forces
        torque_speed(m, d, term);
        break;
      case SERVO_DEAD_BAND: servo_dead_band(m, d, term); break;
      default:
        if (dry(term)) holding++;
        else if (slides(term)) changed |= sliding_friction(m, d, term);
        else push(m, d, term);
    }
  }
  if (changed) island(m, d), project(m, d);   // both have copied what was changed
  if (holding) hold(m, d, program, holding);
}
