#include "dem_reference/ledger/moment.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace grainpair::ledger {

namespace {

// The engine has cut the spring at this step where k_t |s| = mu |F_n| to round-off. That of F_n is
// its two terms', and theirs the overlap's, a small difference of coordinates.
constexpr double kSlidingTolerance = 1e-8, kRoundOff = 1e-15;

Vector row_of(const double* values, std::int64_t k) {
  return Eigen::Map<const Vector>(values + 3 * k);
}

}  // namespace

void Moment::look(const Atoms& atoms, std::span<const double> rows, std::span<const Plane> planes) {
  atoms_ = atoms;
  half_step_velocities();
  double reach = 0.0;
  for (std::int64_t k = 0; k < 3 * atoms.count; ++k) reach = std::max(reach, std::abs(atoms.x[k]));
  pairs_.clear();
  pair_force_.assign(atoms.count, Vector::Zero());
  const bool rolls = scene_.rolling() != Rolling::none;
  if (rolls) pair_torque_.assign(atoms.count, Vector::Zero());
  const auto columns = static_cast<std::size_t>(scene_.columns());
  const auto contact = atoms.radius
                           ? (rolls ? &Moment::pair<false, true> : &Moment::pair<false, false>)
                           : (rolls ? &Moment::pair<true, true> : &Moment::pair<true, false>);
  for (std::size_t k = 0; k < rows.size(); k += columns) {
    const Pair& made = pairs_.emplace_back((this->*contact)(&rows[k], reach));
    pair_force_[made.first] += made.force;
    pair_force_[made.second] -= made.force;
    if (rolls) add_torque(made);
  }
  touches_.clear();
  for (const Plane& plane : planes) touch(plane);
  wall_friction();
  if (rolls) wall_rolling();
  sums();
}

/// Velocities the force was evaluated with; a glued grain has none.
void Moment::half_step_velocities() {
  const std::int64_t n = atoms_.count;
  mobile_.resize(n);
  v_half_.resize(n);
  omega_half_.resize(n);
  place_.assign(place_.size(), -1);
  for (std::int64_t k = 0; k < n; ++k) {
    const auto id = static_cast<std::size_t>(atoms_.id[k]);
    if (id >= place_.size()) place_.resize(id + 1, -1);
    place_[id] = k;
    mobile_[k] = atoms_.type[k] == kMobile;
    v_half_[k] = omega_half_[k] = Vector::Zero();
    if (!mobile_[k]) continue;
    v_half_[k] = row_of(atoms_.v, k) - scene_.time_step / (2 * mass(k)) * row_of(atoms_.f, k);
    omega_half_[k] =
        row_of(atoms_.omega, k) - scene_.time_step / (2 * inertia(k)) * row_of(atoms_.torque, k);
  }
}

/// Of a contact, what its rolling resistance goes with.
struct Moment::Stiffness {
  double reduced_radius;   // r1 r2 / (r1 + r2)
  double k_n, k_t;         // F_n / overlap of Hertz; tangential
  double rate;             // of both: (dk/dt) / k
  double f_n, force_rate;  // normal force, dF_n/dt
  double doubt;            // of the normal force's round-off, as of the bound of friction
};

/// Equal: whether all grains have the scene's radius; Rolls: whether they resist rolling. Both are
/// known to the compiler, so that plain grains cost and round as if there were no others.
// long: one contact law, whose terms share nearly all they are made of
template <bool Equal, bool Rolls>
Pair Moment::pair(const double* row, double reach) const {
  const auto first = static_cast<std::uint64_t>(row[0]),
             second = static_cast<std::uint64_t>(row[1]);
  const auto [lower, upper] = std::minmax(first, second);
  const std::size_t ids = place_.size();
  if (first >= ids || second >= ids || place_[first] < 0 || place_[second] < 0)
    throw std::out_of_range("a contact of a grain that is not here");
  const std::int64_t i = place_[first], j = place_[second];
  const bool moves_i = mobile_[i], moves_j = mobile_[j];
  Pair out{};
  out.first = i, out.second = j;
  out.counts = place_[lower] < atoms_.owned;
  out.key = lower << 32 | upper;

  out.branch = row_of(atoms_.x, i) - row_of(atoms_.x, j);
  if (scene_.thickness > 0)
    out.branch.z() -= scene_.thickness * std::nearbyint(out.branch.z() / scene_.thickness);
  if (scene_.length > 0)
    out.branch.x() -= scene_.length * std::nearbyint(out.branch.x() / scene_.length);
  const double r_i = Equal ? scene_.radius : radius(i), r_j = Equal ? scene_.radius : radius(j);
  const double distance = out.branch.norm(), delta = r_i + r_j - distance;
  const Vector n = out.normal = out.branch / distance;
  out.overlap = delta;
  out.arm = r_i - delta / 2;
  const double arm_j = r_j - delta / 2;

  // spins of the two, or of equal grains their sum
  const auto slip = [&](const Vector& velocity, const Vector& spin, const Vector& other,
                        double& along) -> Vector {
    along = velocity.dot(n);
    if constexpr (Equal)
      return velocity - along * n - (out.arm * spin).cross(n);
    else
      return velocity - along * n - (out.arm * spin + arm_j * other).cross(n);
  };
  const auto now = [&](const double* values) -> Vector {
    return (moves_i ? row_of(values, i) : Vector::Zero()) -
           (moves_j ? row_of(values, j) : Vector::Zero());
  };
  double v_n = 0.0, u_n = 0.0;
  Vector v_t, u_t;
  if constexpr (Equal) {
    v_t = slip(v_half_[i] - v_half_[j], omega_half_[i] + omega_half_[j], Vector::Zero(), v_n);
    const Vector spin = (moves_i ? row_of(atoms_.omega, i) : Vector::Zero()) +
                        (moves_j ? row_of(atoms_.omega, j) : Vector::Zero());
    u_t = slip(now(atoms_.v), spin, Vector::Zero(), u_n);
  } else {
    const auto spin = [&](std::int64_t k, bool moves) -> Vector {
      return moves ? row_of(atoms_.omega, k) : Vector::Zero();
    };
    v_t = slip(v_half_[i] - v_half_[j], omega_half_[i], omega_half_[j], v_n);
    u_t = slip(now(atoms_.v), spin(i, moves_i), spin(j, moves_j), u_n);
  }

  // R* = r/2 and m* = m/2 of equal grains; the glued grain's mass is infinite
  const double m_i = Equal ? scene_.mass : mass(i), m_j = Equal ? scene_.mass : mass(j);
  const double both = Equal ? m_i / 2 : m_i * m_j / (m_i + m_j), mu = scene_.friction;
  const double m = moves_i && moves_j ? both : moves_i ? m_i : m_j;
  const double r = Equal ? r_i / 2 : r_i * r_j / (r_i + r_j);
  const double root = std::sqrt(r * delta);
  const double s_n = 2 * scene_.contact_modulus * root,
               k_t = 8 * scene_.contact_shear_modulus * root;
  const double gamma_n = scene_.damping_factor * std::sqrt(s_n * m);
  const double gamma_t = scene_.damping_factor * std::sqrt(k_t * m);
  const double f_hertz = 4.0 / 3.0 * scene_.contact_modulus * root * delta;
  const double f_n = f_hertz - gamma_n * v_n;
  const Vector s = row_of(row + 3, 0);
  const double blur =
      (kSlidingTolerance + kRoundOff * reach / delta) * mu * (f_hertz + gamma_n * std::abs(v_n));
  const bool sliding = k_t * s.norm() >= mu * std::abs(f_n) - blur;
  const Vector f_t = sliding ? Vector(-k_t * s) : Vector(-k_t * s - gamma_t * v_t);
  out.force = f_n * n + f_t;

  out.elastic[0] = 8.0 / 15.0 * scene_.contact_modulus * root * delta * delta;
  out.elastic[1] = k_t * s.squaredNorm() / 2;
  out.power[0] = gamma_n * v_n * u_n;
  out.work_rate[0] = -f_n * u_n;
  out.work_rate[1] = -f_t.dot(u_t);
  const double rate = -u_n / (2 * delta);  // (dk_t/dt) / k_t, with d(delta)/dt = -u_n
  const auto force_rate = [&] {            // -S_n u_n - gamma_n du_n/dt - (rate/2) gamma_n v_n
    const auto pulled = [&](std::int64_t k, bool moves, double mass) -> double {
      return moves ? row_of(atoms_.f, k).dot(n) / mass : 0.0;
    };
    const double pull =
        Equal ? now(atoms_.f).dot(n) / m_i : pulled(i, moves_i, m_i) - pulled(j, moves_j, m_j);
    const double du_n = pull + u_t.squaredNorm() / distance;
    return -s_n * u_n - gamma_n * du_n - rate / 2 * gamma_n * v_n;
  };
  if (sliding) {
    // d/dt [(mu F_n)^2 / (2 k_t)]
    const double df_n = force_rate();
    out.power[1] = out.work_rate[1] - mu * mu * f_n / k_t * (df_n - rate / 2 * f_n);
  } else {
    out.power[1] = gamma_t * v_t.dot(u_t) - rate * out.elastic[1];
  }
  if constexpr (Rolls) {
    const double doubt =
        (kSlidingTolerance + kRoundOff * reach / delta) * (f_hertz + gamma_n * std::abs(v_n));
    roll(row_of(row + 6, 0), {r, f_hertz / delta, k_t, rate, f_n, force_rate(), doubt}, out);
  }
  return out;
}

/// Rolling resistance [LIGGGHTS 3.8, rolling_friction epsd and epsd2]: its spring's torque M_s is
/// wound up by k_r w_t dt and cut to mu_r |F_n| R*; epsd adds 2 eta_r sqrt(I_r k_r) w_t while it is
/// not cut.
///     epsd:  k_r = 9/4 k_n mu_r^2 R*^2,  I_r = 7/5 of the reduced m r^2
///     epsd2: k_r = k_t R*^2
void Moment::roll(const Vector& spring, const Stiffness& of, Pair& pair) const {
  const double mu = scene_.rolling_friction, most = mu * of.reduced_radius;
  const bool dashpot = scene_.rolling() == Rolling::epsd;
  const double k_r =
      dashpot ? 2.25 * of.k_n * most * most : of.k_t * of.reduced_radius * of.reduced_radius;
  const auto spin = [&](const Vector& first, const Vector& second) -> Vector {
    return (mobile_[pair.first] ? first : Vector::Zero()) -
           (mobile_[pair.second] ? second : Vector::Zero());
  };
  const auto across = [&](const Vector& w) -> Vector {
    return w - w.dot(pair.normal) * pair.normal;
  };
  const Vector w = spin(row_of(atoms_.omega, pair.first), row_of(atoms_.omega, pair.second));
  const Vector before = across(spin(omega_half_[pair.first], omega_half_[pair.second]));
  const bool full = spring.norm() >= most * (std::abs(of.f_n) - of.doubt);
  Vector torque = spring;
  if (dashpot && !full) {
    const double a = mass(pair.first) * radius(pair.first) * radius(pair.first),
                 b = mass(pair.second) * radius(pair.second) * radius(pair.second);
    torque += 2 * scene_.rolling_damping * std::sqrt(1.4 * a * b / (a + b) * k_r) * before;
  }
  pair.torque = -torque;
  pair.elastic[2] = spring.squaredNorm() / (2 * k_r);
  pair.work_rate[2] = torque.dot(w);
  const double stored = full ? most * most * of.f_n / k_r * (of.force_rate - of.rate / 2 * of.f_n)
                             : spring.dot(across(w)) - of.rate * pair.elastic[2];
  pair.power[2] = pair.work_rate[2] - stored;
}

/// What a contact turns its grains by: friction at its arms, and rolling resistance.
void Moment::add_torque(const Pair& pair) {
  const Vector turn = pair.normal.cross(pair.force);
  const double other = radius(pair.second) - pair.overlap / 2;
  pair_torque_[pair.first] += pair.torque - pair.arm * turn;
  pair_torque_[pair.second] -= pair.torque + other * turn;
}

/// Contacts of owned grains with one wall: R* = r, m* = m; its edges may be touched from beyond.
void Moment::touch(const Plane& plane) {
  for (std::int64_t k = 0; k < atoms_.owned; ++k) {
    const double r = radius(k);
    const Vector x = row_of(atoms_.x, k);
    if (!mobile_[k] || std::abs(x[plane.axis] - plane.position) >= r) continue;
    Vector gap = Vector::Zero();  // from the nearest point of the wall to the centre
    gap[plane.axis] = x[plane.axis] - plane.position;
    gap.x() += std::min(x.x() - plane.begin, 0.0);
    gap.y() += std::min(x.y() - plane.lowest, 0.0);
    const double distance = gap.norm(), delta = r - distance;
    if (distance >= r) continue;
    const Vector n = gap / distance;
    const double speed = plane.rise * n.y();
    const double v_n = v_half_[k].dot(n) - speed, u_n = row_of(atoms_.v, k).dot(n) - speed;
    const double root = std::sqrt(r * delta), y = scene_.contact_modulus;
    const double gamma = scene_.wall_damping_factor * std::sqrt(2 * y * root * mass(k));
    const double f_n = 4.0 / 3.0 * y * root * delta - gamma * v_n;
    touches_.push_back({k, plane.code, plane.friction > 0, n, distance * n, f_n * n, delta,
                        8.0 / 15.0 * y * root * delta * delta, gamma * v_n * u_n, -f_n * u_n,
                        f_n * speed});
  }
}

/// The friction of a Coulomb wall is what the engine's force leaves over after grain contacts,
/// gravity and the walls' normal forces; of two Coulomb walls touched at once the first takes it.
/// Of a rising gate, which is smooth, only the edge does work on the grains (`driven`).
void Moment::wall_friction() {
  rest_.resize(atoms_.owned);
  for (std::int64_t k = 0; k < atoms_.owned; ++k) {
    rest_[k] = row_of(atoms_.f, k) - pair_force_[k];
    rest_[k].y() += mass(k) * scene_.gravity;
    rest_[k].x() -= mass(k) * scene_.pull;
  }
  rough_walls_.assign(atoms_.owned, 0);
  for (const Touch& wall : touches_) rest_[wall.grain] -= wall.force;
  for (Touch& wall : touches_) {
    const std::int64_t grain = wall.grain;
    if (!wall.rough || ++rough_walls_[grain] > 1) continue;
    const Vector& n = wall.normal;
    const Vector f_t = rest_[grain] - rest_[grain].dot(n) * n;
    const Vector u = row_of(atoms_.v, grain) - row_of(atoms_.omega, grain).cross(wall.branch);
    const double power = f_t.dot(u - u.dot(n) * n);
    wall.force += f_t;
    wall.power -= power;
    wall.work_rate -= power;
    rest_[grain] -= f_t;
  }
}

/// The rolling resistance of a Coulomb wall is what the engine's torque leaves over after grain
/// contacts and the wall's friction; of two such walls the first takes it. What its spring holds is
/// the engine's secret, and counts as dissipated.
void Moment::wall_rolling() {
  rest_torque_.resize(atoms_.owned);
  for (std::int64_t k = 0; k < atoms_.owned; ++k)
    rest_torque_[k] = row_of(atoms_.torque, k) - pair_torque_[k];
  std::vector<char> taken(static_cast<std::size_t>(atoms_.owned), 0);
  for (Touch& wall : touches_) {
    const std::int64_t grain = wall.grain;
    if (!wall.rough || taken[grain]++) continue;
    const Vector f_t = wall.force - wall.force.dot(wall.normal) * wall.normal;
    const Vector torque = rest_torque_[grain] + wall.branch.cross(f_t);
    const double power = torque.dot(row_of(atoms_.omega, grain));
    wall.power -= power;
    wall.work_rate -= power;
  }
}

/// What owned grains and counted contacts hold, and the largest difference between the engine's
/// force on a moving grain and the rebuilt one, corners of Coulomb walls aside.
void Moment::sums() {
  held_ = {};
  const bool rolls = scene_.rolling() != Rolling::none;
  for (const Touch& wall : touches_) held_.wall += wall.elastic;
  for (std::int64_t k = 0; k < atoms_.owned; ++k) {
    if (!mobile_[k]) continue;
    held_.kinetic += mass(k) / 2 * row_of(atoms_.v, k).squaredNorm();
    held_.rotational += inertia(k) / 2 * row_of(atoms_.omega, k).squaredNorm();
    held_.potential += mass(k) * scene_.gravity * atoms_.x[3 * k + 1];
    if (rough_walls_[k] < 2)
      held_.force_error = std::max(held_.force_error, rest_[k].cwiseAbs().maxCoeff());
    if (rolls && !rough_walls_[k])
      held_.torque_error = std::max(held_.torque_error, rest_torque_[k].cwiseAbs().maxCoeff());
  }
  for (const Pair& pair : pairs_) {
    if (!pair.counts) continue;
    held_.normal += pair.elastic[0];
    held_.tangential += pair.elastic[1];
    held_.rolling += pair.elastic[2];
  }
}

}  // namespace grainpair::ledger
