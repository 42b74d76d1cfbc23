// The articulated tail by Pinocchio's functions with all that was found to speed them up: v_dot by crba and
// nonLinearEffects of the full chain, and its Jacobians by computeRNEADerivatives, at the solved v_dot.
//
// The chain is a free-flyer and 2 m n tail coordinates; the constant matrix G repeats (alpha_i, beta_i) over the links
// of segment i: H = G^T H_full G, C = G^T C_full.  All is relative to the torso, as in Pinocchio.  Columns that need no
// computation (p_b, p_b_dot: zero; a turn of the torso: only R^T g turns) are left out.
//
// JACOBIANS, if defined, makes the tail of 2 m n revolutes RX and RZ instead of m n universal joints, of which Pinocchio
// computes wrong derivatives; v_dot alone is faster with universal joints.
//
// What single choices add to the time, each measured on one of these paths at (1,3), (3,4), (6,6); Pinocchio 4.1, Eigen
// 3.4, gcc 12, one core with AVX-512: 2 m n revolutes for v_dot +16, +25, +13 %; mimic joints, which need no G +133, +144,
// +150 %; Eigen vectorised +105 %; gcc's own inlining limits +19 %; all 25 joint types in the variant +23 to +31 %; SLP
// vectoriser +8 %; Eigen's LLT instead of the LDL^T below +41, +20, +9 %; G^T H_full G by dense products +26, +25, +49 %.
#define EIGEN_DONT_VECTORIZE
#define BOOST_VARIANT_USE_RELAXED_GET_BY_DEFAULT // the library asks each joint whether it is a mimic one
#define BOOST_FUSION_INVOKE_MAX_ARITY 12         // as the build of Pinocchio sets it

#include <exception>
#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pinocchio/multibody.hpp"
#include "pinocchio/multibody/joint.hpp"

#include "pinocchio/algorithm/crba.hpp"
#include "pinocchio/algorithm/rnea.hpp"
#ifdef JACOBIANS
#include "pinocchio/algorithm/rnea-derivatives.hpp"
#endif

#define PEER_API extern "C" __attribute__((visibility("default")))

namespace {

using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr int BASE = 6;               // degrees of freedom of the torso
constexpr int LONGEST_FOR_LOCAL = 16; // links up to which CRBA is faster in LOCAL convention than in WORLD

// The joint types of the chain and no others, so that a visit chooses between two or three.
template <typename S, int O> struct Joints {
    using Scalar = S;
    static constexpr int Options = O;
#ifdef JACOBIANS
    using JointModelVariant =
        boost::variant<pinocchio::JointModelFreeFlyerTpl<S, O>, pinocchio::JointModelRevoluteTpl<S, O, 0>,
                       pinocchio::JointModelRevoluteTpl<S, O, 2>>;
    using JointDataVariant =
        boost::variant<pinocchio::JointDataFreeFlyerTpl<S, O>, pinocchio::JointDataRevoluteTpl<S, O, 0>,
                       pinocchio::JointDataRevoluteTpl<S, O, 2>>;
#else
    using JointModelVariant = boost::variant<pinocchio::JointModelFreeFlyerTpl<S, O>, //
                                             pinocchio::JointModelUniversalTpl<S, O>>;
    using JointDataVariant = boost::variant<pinocchio::JointDataFreeFlyerTpl<S, O>, //
                                            pinocchio::JointDataUniversalTpl<S, O>>;
#endif
};

using Model = pinocchio::ModelTpl<double, 0, Joints>;
using Data = pinocchio::DataTpl<double, 0, Joints>;
using pinocchio::Inertia;
using pinocchio::SE3;

// In the order in which they are handed over.
struct Parameters {
    double gravity, torso_mass, torso_inertia[3], tail_mount[3], tail_mass, tail_length, link_inertia[3];
};

Inertia body(double mass, const Vector3d &com, const double *diagonal)
{
    return Inertia(mass, com, Vector3d::Map(diagonal).asDiagonal().toDenseMatrix());
}

Model chain_model(int count, const Parameters &p)
{
    Model model;
    model.gravity.linear(Vector3d(0, 0, -p.gravity));
    auto joint = model.addJoint(0, pinocchio::JointModelFreeFlyer(), SE3::Identity(), "torso");
    model.appendBodyToJoint(joint, body(p.torso_mass, Vector3d::Zero(), p.torso_inertia));

    const double length = p.tail_length / count;
    const Inertia link = body(p.tail_mass / count, Vector3d(0, -length / 2, 0), p.link_inertia);
    Vector3d origin = Vector3d::Map(p.tail_mount);
    for (int j = 0; j < count; ++j) {
        const SE3 placement(Eigen::Matrix3d::Identity(), origin);
#ifdef JACOBIANS
        joint = model.addJoint(joint, pinocchio::JointModelRX(), placement, "pitch_" + std::to_string(j));
        joint = model.addJoint(joint, pinocchio::JointModelRZ(), SE3::Identity(), "yaw_" + std::to_string(j));
#else
        const pinocchio::JointModelUniversal universal(Vector3d::UnitX(), Vector3d::UnitZ());
        joint = model.addJoint(joint, universal, placement, "joint_" + std::to_string(j));
#endif
        model.appendBodyToJoint(joint, link);
        origin = Vector3d(0, -length, 0);
    }
    return model;
}

struct Chain {
    Chain(int segments, int links, const Parameters &parameters)
        : m(segments), n(links), model(chain_model(m * n, parameters)), data(model),
          q(VectorXd::Zero(model.nq)), v(VectorXd::Zero(model.nv)),
          H(MatrixXd::Zero(BASE + 2 * m, BASE + 2 * m)), x(VectorXd::Zero(BASE + 2 * m)), a(v),
          dq(MatrixXd::Zero(model.nv, model.nv)), dv(dq), da(dq), X(RowMajor::Zero(BASE + 2 * m, columns()))
    {
    }

    int columns() const { return 6 * m + 3; } // dq: tail; dv: omega, tail; dtau: tail

    int m, n;
    Model model;
    Data data;
    VectorXd q, v;       // of the full chain
    MatrixXd H;          // reduced; lower triangle
    VectorXd x;          // reduced bias, then right-hand side, then solution
    VectorXd a;          // of the full chain
    MatrixXd dq, dv, da; // of its inverse dynamics
    RowMajor X;          // reduced right-hand sides of the Jacobians, then the result
};

// State of the full chain.  Position and p_dot stay zero: H and C do not depend on them, and with v_b = 0 the
// first three accelerations are R^T p_ddot.
void set_configuration(Chain &chain, const double *q)
{
    chain.q.segment<4>(3) << q[4], q[5], q[6], q[3]; // (w, x, y, z) to (x, y, z, w)
    double *angle = chain.q.data() + 7;
    for (int i = 0; i < chain.m; ++i)
        for (int j = 0; j < chain.n; ++j) {
            *angle++ = q[7 + 2 * i];
            *angle++ = q[8 + 2 * i];
        }
}

void set_velocity(Chain &chain, const double *v)
{
    chain.v.segment<3>(3) = Vector3d::Map(v + 3);
    double *rate = chain.v.data() + BASE;
    for (int i = 0; i < chain.m; ++i)
        for (int j = 0; j < chain.n; ++j) {
            *rate++ = v[BASE + 2 * i];
            *rate++ = v[BASE + 1 + 2 * i];
        }
}

// x = C = G^T C_full
void bias_force(Chain &chain)
{
    const VectorXd &full = pinocchio::nonLinearEffects(chain.model, chain.data, chain.q, chain.v);
    chain.x.head<BASE>() = full.head<BASE>();
    const double *entry = full.data() + BASE;
    for (int i = 0; i < chain.m; ++i) {
        double alpha = 0, beta = 0;
        for (int j = 0; j < chain.n; ++j) {
            alpha += *entry++;
            beta += *entry++;
        }
        chain.x[BASE + 2 * i] = alpha;
        chain.x[BASE + 1 + 2 * i] = beta;
    }
}

// Diagonal block of segment i from the upper triangle of H_full.
void sum_own_blocks(Chain &chain, int i)
{
    const MatrixXd &full = chain.data.M;
    const int first = BASE + 2 * i * chain.n;
    double aa = 0, ab = 0, bb = 0;
    for (int l = 0; l < chain.n; ++l) {
        const double *alpha = &full(first, first + 2 * l), *beta = &full(first, first + 2 * l + 1);
        for (int j = 0; j < l; ++j) {
            aa += 2 * alpha[2 * j];
            ab += alpha[2 * j + 1] + beta[2 * j];
            bb += 2 * beta[2 * j + 1];
        }
        aa += alpha[2 * l];
        ab += beta[2 * l];
        bb += beta[2 * l + 1];
    }
    chain.H.block<2, 2>(BASE + 2 * i, BASE + 2 * i) << aa, ab, ab, bb;
}

// Row of H left of the diagonal block of segment i, from column `side` (alpha: 0, beta: 1) of each link.
void sum_row(Chain &chain, int i, int side)
{
    const int row = BASE + 2 * i + side;
    chain.H.row(row).head(BASE + 2 * i).setZero();
    for (int l = 0; l < chain.n; ++l) {
        const double *entry = chain.data.M.col(BASE + 2 * (i * chain.n + l) + side).data();
        for (int j = 0; j < BASE; ++j)
            chain.H(row, j) += *entry++;
        for (int k = 0; k < i; ++k) {
            double alpha = 0, beta = 0;
            for (int j = 0; j < chain.n; ++j) {
                alpha += *entry++;
                beta += *entry++;
            }
            chain.H(row, BASE + 2 * k) += alpha;
            chain.H(row, BASE + 2 * k + 1) += beta;
        }
    }
}

// H = G^T H_full G by Pinocchio's CRBA.
void crba_mass_matrix(Chain &chain)
{
    const bool is_short = chain.m * chain.n <= LONGEST_FOR_LOCAL;
    pinocchio::crba(chain.model, chain.data, chain.q,
                    is_short ? pinocchio::Convention::LOCAL : pinocchio::Convention::WORLD);
    chain.H.topLeftCorner<BASE, BASE>() = chain.data.M.topLeftCorner<BASE, BASE>().transpose();
    for (int i = 0; i < chain.m; ++i) {
        sum_row(chain, i, 0);
        sum_row(chain, i, 1);
        sum_own_blocks(chain, i);
    }
}

// x := H^-1 x by LDL^T in place, columns of the lower triangle; false where H is not positive definite.
bool solve(MatrixXd &H, VectorXd &x)
{
    const int size = static_cast<int>(x.size());
    bool positive = true;
    for (int j = 0; j < size; ++j) {
        double *column = &H(0, j);
        positive &= column[j] > 0;
        const double inverse = 1 / column[j], x_j = x[j];
        for (int k = j + 1; k < size; ++k) {
            const double factor = column[k] * inverse;
            double *later = &H(0, k);
            for (int i = k; i < size; ++i)
                later[i] -= column[i] * factor;
            x[k] -= factor * x_j;
        }
        column[j] = inverse;
    }
    for (int j = size - 1; j >= 0; --j) {
        const double *column = &H(0, j);
        double sum = x[j];
        for (int i = j + 1; i < size; ++i)
            sum -= column[i] * x[i];
        x[j] = sum * column[j];
    }
    return positive;
}

// From H and the bias in x to v_dot; the status that the caller returns.
int accelerate(Chain &chain, const double *q, const double *tau, double *v_dot)
{
    VectorXd &x = chain.x;
    x = -x;
    x.tail(2 * chain.m) += VectorXd::Map(tau, 2 * chain.m);
    const bool solved = solve(chain.H, x);
    VectorXd::Map(v_dot, x.size()) = x;
    Vector3d::Map(v_dot) = Quaterniond(q[3], q[4], q[5], q[6]) * x.head<3>(); // R^T p_ddot to the world
    return solved ? 0 : 1;
}

// v_dot; 0, or 1 where H is not positive definite.  The quaternion in q is a unit one.
int solve_acceleration(Chain &chain, const double *q, const double *v, const double *tau, double *v_dot)
{
    set_configuration(chain, q);
    set_velocity(chain, v);
    crba_mass_matrix(chain);
    bias_force(chain);
    return accelerate(chain, q, tau, v_dot);
}

#ifdef JACOBIANS
// a of the full chain from the reduced one in x.
void set_acceleration(Chain &chain)
{
    chain.a.head<BASE>() = chain.x.head<BASE>();
    double *rate = chain.a.data() + BASE;
    for (int i = 0; i < chain.m; ++i)
        for (int j = 0; j < chain.n; ++j) {
            *rate++ = chain.x[BASE + 2 * i];
            *rate++ = chain.x[BASE + 1 + 2 * i];
        }
}

// -G^T of one column of the full chain, added to column `to` of X.
void subtract_column(Chain &chain, const double *entry, int to)
{
    const auto width = chain.X.cols();
    double *out = chain.X.data() + to;
    for (int r = 0; r < BASE; ++r, out += width)
        *out -= *entry++;
    for (int i = 0; i < chain.m; ++i, out += 2 * width) {
        double alpha = 0, beta = 0;
        for (int j = 0; j < chain.n; ++j) {
            alpha += *entry++;
            beta += *entry++;
        }
        out[0] -= alpha;
        out[width] -= beta;
    }
}

// X = [-G^T dq G, -G^T dv G, unit torques]
void reduce(Chain &chain)
{
    const int tail = 2 * chain.m;
    chain.X.setZero();
    for (int k = 0; k < 3; ++k)
        subtract_column(chain, chain.dv.col(3 + k).data(), tail + k);
    for (int c = 0; c < tail * chain.n; ++c) {
        const int to = 2 * (c / 2 / chain.n) + c % 2;
        subtract_column(chain, chain.dq.col(BASE + c).data(), to);
        subtract_column(chain, chain.dv.col(BASE + c).data(), tail + 3 + to);
    }
    for (int k = 0; k < tail; ++k)
        chain.X(BASE + k, 2 * tail + 3 + k) = 1;
}

// X := H^-1 X with what solve() has left in H.
void solve_all(Chain &chain)
{
    const MatrixXd &H = chain.H;
    const int size = static_cast<int>(H.rows()), width = chain.columns();
    double *const X = chain.X.data();
    for (int j = 0; j < size; ++j)
        for (int i = j + 1; i < size; ++i) {
            const double factor = H(i, j) * H(j, j);
            for (int k = 0; k < width; ++k)
                X[i * width + k] -= factor * X[j * width + k];
        }
    for (int j = size - 1; j >= 0; --j) {
        double *row = X + j * width;
        for (int i = j + 1; i < size; ++i) {
            const double factor = H(i, j);
            for (int k = 0; k < width; ++k)
                row[k] -= factor * X[i * width + k];
        }
        for (int k = 0; k < width; ++k)
            row[k] *= H(j, j);
    }
}
#endif

} // namespace

// From gravity, torso_mass, torso_inertia (3), tail_mount (3), tail_mass, tail_length, link_inertia (3) to a
// chain, or to a null pointer where it cannot be built.
PEER_API void *pinocchio_chain_new(int segments, int links, const double *parameters)
try {
    static_assert(sizeof(Parameters) == 13 * sizeof(double), "parameters are an array of 13");
    return new Chain(segments, links, *reinterpret_cast<const Parameters *>(parameters));
} catch (const std::exception &) {
    return nullptr;
}

PEER_API void pinocchio_chain_free(void *chain)
{
    delete static_cast<Chain *>(chain);
}

PEER_API int pinocchio_forward_dynamics(void *context, const double *q, const double *v, const double *tau,
                                        double *v_dot)
{
    return solve_acceleration(*static_cast<Chain *>(context), q, v, tau, v_dot);
}

#ifdef JACOBIANS
// The latest result: dq, dv (nv x nv) and dtau (nv x 2m), row-major, zero where it was not computed.
PEER_API void pinocchio_derivatives_result(void *context, double *dq, double *dv, double *dtau)
{
    const Chain &chain = *static_cast<Chain *>(context);
    const int nv = BASE + 2 * chain.m, tail = 2 * chain.m;
    Eigen::Map<RowMajor> of_q(dq, nv, nv), of_v(dv, nv, nv), of_tau(dtau, nv, tail);
    of_q.setZero();
    of_v.setZero();
    of_q.rightCols(tail) = chain.X.leftCols(tail);
    of_v.rightCols(tail + 3) = chain.X.middleCols(tail, tail + 3);
    of_tau = chain.X.rightCols(tail);
}

PEER_API int pinocchio_forward_dynamics_derivatives(void *context, const double *q, const double *v,
                                                    const double *tau, double *v_dot)
{
    Chain &chain = *static_cast<Chain *>(context);
    const int status = solve_acceleration(chain, q, v, tau, v_dot);
    set_acceleration(chain);
    pinocchio::computeRNEADerivatives(chain.model, chain.data, chain.q, chain.v, chain.a, chain.dq, chain.dv,
                                      chain.da);
    reduce(chain);
    solve_all(chain);
    return status;
}
#endif
