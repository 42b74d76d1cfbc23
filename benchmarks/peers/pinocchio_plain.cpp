// From parameters of the articulated tail and states in this project's conventions to v_dot, through Pinocchio as
// its documentation shows it: default joint types RX and RZ, crba and nonLinearEffects of the full chain, G^T H G
// with the constant matrix G that repeats (alpha_i, beta_i), Eigen's LLT; and to the Jacobians of v_dot, by
// computeRNEADerivatives of the full chain.  pinocchio_chain.cpp and pinocchio_derivatives.cpp have tuned paths.
// what Pinocchio's own build sets: more than 20 joint types in one variant
#define BOOST_MPL_CFG_NO_PREPROCESSED_HEADERS
#define BOOST_MPL_LIMIT_LIST_SIZE 30
#define BOOST_MPL_LIMIT_VECTOR_SIZE 30
#define BOOST_FUSION_INVOKE_MAX_ARITY 12
#define BOOST_VARIANT_USE_RELAXED_GET_BY_DEFAULT

#include <exception>
#include <string>

#include <Eigen/Cholesky>

#include "pinocchio/multibody.hpp"
#include "pinocchio/multibody/joint.hpp"

#include "pinocchio/algorithm/crba.hpp"
#include "pinocchio/algorithm/rnea-derivatives.hpp"
#include "pinocchio/algorithm/rnea.hpp"

#define PEER_API extern "C" __attribute__((visibility("default")))

namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using pinocchio::Inertia;
using pinocchio::SE3;

struct Parameters {
    double gravity, torso_mass, torso_inertia[3], tail_mount[3], tail_mass, tail_length, link_inertia[3];
};

Inertia body(double mass, const Vector3d &com, const double *diagonal)
{
    return Inertia(mass, com, Vector3d::Map(diagonal).asDiagonal().toDenseMatrix());
}

pinocchio::Model chain_model(int count, const Parameters &p)
{
    pinocchio::Model model;
    model.gravity.linear(Vector3d(0, 0, -p.gravity));
    auto joint = model.addJoint(0, pinocchio::JointModelFreeFlyer(), SE3::Identity(), "torso");
    model.appendBodyToJoint(joint, body(p.torso_mass, Vector3d::Zero(), p.torso_inertia));
    const double length = p.tail_length / count;
    Vector3d origin = Vector3d::Map(p.tail_mount);
    for (int j = 0; j < count; ++j) {
        const SE3 placement(Eigen::Matrix3d::Identity(), origin);
        joint = model.addJoint(joint, pinocchio::JointModelRX(), placement, "pitch_" + std::to_string(j));
        joint = model.addJoint(joint, pinocchio::JointModelRZ(), SE3::Identity(), "yaw_" + std::to_string(j));
        model.appendBodyToJoint(joint, body(p.tail_mass / count, Vector3d(0, -length / 2, 0), p.link_inertia));
        origin = Vector3d(0, -length, 0);
    }
    return model;
}

struct Chain {
    Chain(int segments, int links, const Parameters &parameters)
        : m(segments), n(links), model(chain_model(m * n, parameters)), data(model), q(model.nq), v(model.nv),
          G(MatrixXd::Zero(model.nv, 6 + 2 * m)), llt(6 + 2 * m), full_dq(MatrixXd::Zero(model.nv, model.nv)),
          full_dv(full_dq), full_da(full_dq), unit(MatrixXd::Zero(6 + 2 * m, 2 * m))
    {
        unit.bottomRows(2 * m).setIdentity();
        G.topLeftCorner(6, 6).setIdentity();
        for (int j = 0; j < m * n; ++j)
            for (int side = 0; side < 2; ++side)
                G(6 + 2 * j + side, 6 + 2 * (j / n) + side) = 1;
    }

    int m, n;
    pinocchio::Model model;
    pinocchio::Data data;
    VectorXd q, v;
    MatrixXd G;
    Eigen::LLT<MatrixXd> llt;
    VectorXd a;                          // reduced; the first three rows R^T p_b_ddot - omega x R^T p_b_dot
    MatrixXd full_dq, full_dv, full_da;  // of the inverse dynamics of the full chain
    MatrixXd unit, dq, dv, dtau;         // unit torques; the result
};

} // namespace

PEER_API void *pinocchio_chain_new(int segments, int links, const double *parameters)
try {
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
    Chain &chain = *static_cast<Chain *>(context);
    const Eigen::Matrix3d R = Eigen::Quaterniond(q[3], q[4], q[5], q[6]).toRotationMatrix();
    const Vector3d velocity = R.transpose() * Vector3d::Map(v), omega = Vector3d::Map(v + 3);
    const int nt = 2 * chain.m;
    chain.q.head<7>() << q[0], q[1], q[2], q[4], q[5], q[6], q[3];
    chain.q.tail(chain.model.nv - 6) = chain.G.bottomRightCorner(chain.model.nv - 6, nt) * VectorXd::Map(q + 7, nt);
    chain.v.head<6>() << velocity, omega;
    chain.v.tail(chain.model.nv - 6) = chain.G.bottomRightCorner(chain.model.nv - 6, nt) * VectorXd::Map(v + 6, nt);

    pinocchio::crba(chain.model, chain.data, chain.q);
    chain.data.M.triangularView<Eigen::StrictlyLower>() = chain.data.M.transpose();
    pinocchio::nonLinearEffects(chain.model, chain.data, chain.q, chain.v);
    VectorXd load = -(chain.G.transpose() * chain.data.nle);
    load.tail(nt) += VectorXd::Map(tau, nt);
    chain.llt.compute(chain.G.transpose() * chain.data.M * chain.G);
    chain.a = chain.llt.solve(load);
    Vector3d::Map(v_dot) = R * (chain.a.head<3>() + omega.cross(velocity));
    VectorXd::Map(v_dot + 3, 3 + nt) = chain.a.tail(3 + nt);
    return chain.llt.info() == Eigen::Success ? 0 : 1;
}

// dq and dv in Pinocchio's tangent space and velocity, both relative to the torso.
PEER_API int pinocchio_forward_dynamics_derivatives(void *context, const double *q, const double *v,
                                                    const double *tau, double *v_dot)
{
    Chain &chain = *static_cast<Chain *>(context);
    const int status = pinocchio_forward_dynamics(context, q, v, tau, v_dot);
    pinocchio::computeRNEADerivatives(chain.model, chain.data, chain.q, chain.v, chain.G * chain.a, chain.full_dq,
                                      chain.full_dv, chain.full_da);
    chain.dq = chain.llt.solve(-(chain.G.transpose() * chain.full_dq * chain.G));
    chain.dv = chain.llt.solve(-(chain.G.transpose() * chain.full_dv * chain.G));
    chain.dtau = chain.llt.solve(chain.unit);
    return status;
}

// The latest result: dq, dv (nv x nv) and dtau (nv x 2m), row-major.
PEER_API void pinocchio_derivatives_result(void *context, double *dq, double *dv, double *dtau)
{
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Chain &chain = *static_cast<Chain *>(context);
    const int nt = 2 * chain.m;
    Eigen::Map<RowMajor>(dq, 6 + nt, 6 + nt) = chain.dq;
    Eigen::Map<RowMajor>(dv, 6 + nt, 6 + nt) = chain.dv;
    Eigen::Map<RowMajor>(dtau, 6 + nt, nt) = chain.dtau;
}
