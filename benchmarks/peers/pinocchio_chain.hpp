// The articulated tail on Pinocchio's types, with what pinocchio_chain.cpp lists as fastest: chain, state, H, bias.
// REVOLUTES, if defined, makes the tail of 2 m n revolutes RX and RZ instead of m n universal joints, of which
// Pinocchio computes wrong derivatives.
#pragma once
#define EIGEN_DONT_VECTORIZE
#define BOOST_VARIANT_USE_RELAXED_GET_BY_DEFAULT // the library asks each joint whether it is a mimic one

#include <exception>
#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pinocchio/multibody.hpp"
#include "pinocchio/multibody/joint.hpp"

#include "pinocchio/algorithm/jacobian.hpp"
#include "pinocchio/algorithm/kinematics.hpp"
#include "pinocchio/algorithm/rnea.hpp"

#define PEER_API extern "C" __attribute__((visibility("default")))

namespace {

using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Matrix62 = Eigen::Matrix<double, 6, 2>;
using Matrix66 = Eigen::Matrix<double, 6, 6>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr int BASE = 6;               // degrees of freedom of the torso
constexpr int TORSO = 1;              // Pinocchio's index of the torso's joint

// The joint types of the chain and no others, so that a visit chooses between two or three.
template <typename S, int O> struct Joints {
    using Scalar = S;
    static constexpr int Options = O;
#ifdef REVOLUTES
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

// Pinocchio's index of the joint that carries link j.
constexpr int joint_of(int link)
{
#ifdef REVOLUTES
    return TORSO + 2 + 2 * link;
#else
    return TORSO + 1 + link;
#endif
}

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
#ifdef REVOLUTES
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
          H(MatrixXd::Zero(BASE + 2 * m, BASE + 2 * m)), x(VectorXd::Zero(BASE + 2 * m)), F(6, 2 * m)
    {
    }

    int m, n;
    Model model;
    Data data;
    VectorXd q, v;                              // of the full chain
    MatrixXd H;                                 // reduced; lower triangle
    VectorXd x;                                 // reduced bias, then right-hand side, then solution
    Eigen::Matrix<double, 6, Eigen::Dynamic> F; // force columns summed over a segment, two a segment
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

// Columns of segment i.  Y is the inertia of all links behind, and takes its own in; F_j = Y_j J_j,
// H_ii = sum_j (J_j^T F_j + J_j^T F_behind + F_behind^T J_j), H_ki = (sum_k F)^T (sum_j J_j) for k behind i.
void segment_columns(Chain &chain, int i, Inertia &Y)
{
    Data &data = chain.data;
    Matrix62 F_behind = Matrix62::Zero(), J_sum = Matrix62::Zero(), F;
    Eigen::Matrix2d H_ii = Eigen::Matrix2d::Zero();
    for (int j = (i + 1) * chain.n - 1; j >= i * chain.n; --j) {
        Y += data.oMi[joint_of(j)].act(chain.model.inertias[joint_of(j)]);
        const Matrix62 J = data.J.middleCols<2>(BASE + 2 * j);
        pinocchio::motionSet::inertiaAction(Y, J, F);
        const auto alpha = J.col(0), beta = J.col(1); // scalar products: faster than the 2 x 2 expressions
        H_ii(0, 0) += alpha.dot(F.col(0)) + 2 * alpha.dot(F_behind.col(0));
        H_ii(1, 0) += alpha.dot(F.col(1)) + alpha.dot(F_behind.col(1)) + beta.dot(F_behind.col(0));
        H_ii(1, 1) += beta.dot(F.col(1)) + 2 * beta.dot(F_behind.col(1));
        F_behind += F;
        J_sum += J;
    }
    const int row = BASE + 2 * i;
    chain.H.block<2, 2>(row, row) = H_ii;
    chain.F.middleCols<2>(2 * i) = F_behind;
    for (int k = i + 1; k < chain.m; ++k)
        chain.H.block<2, 2>(BASE + 2 * k, row).noalias() = chain.F.middleCols<2>(2 * k).transpose() * J_sum;
}

// H by composite inertias in world axes, on the kinematics that bias_force has left in data.
void composite_mass_matrix(Chain &chain)
{
    Data &data = chain.data;
    pinocchio::updateGlobalPlacements(chain.model, data);
    pinocchio::computeJointJacobians(chain.model, data);
    Inertia Y = Inertia::Zero();
    for (int i = chain.m - 1; i >= 0; --i)
        segment_columns(chain, i, Y);
    Y += data.oMi[TORSO].act(chain.model.inertias[TORSO]);

    const Matrix66 J = data.J.leftCols<BASE>();
    Matrix66 F;
    pinocchio::motionSet::inertiaAction(Y, J, F);
    chain.H.topLeftCorner<BASE, BASE>().noalias() = J.transpose() * F;
    for (int k = 0; k < chain.m; ++k)
        chain.H.block<2, BASE>(BASE + 2 * k, 0).noalias() = chain.F.middleCols<2>(2 * k).transpose() * J;
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

// v_dot by the fastest path; 0, or 1 where H is not positive definite.  The quaternion in q is a unit one.
int solve_acceleration(Chain &chain, const double *q, const double *v, const double *tau, double *v_dot)
{
    set_configuration(chain, q);
    set_velocity(chain, v);
    bias_force(chain);
    composite_mass_matrix(chain);
    return accelerate(chain, q, tau, v_dot);
}

} // namespace
