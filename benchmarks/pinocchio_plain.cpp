// From parameters of the articulated tail and states in this project's conventions to v_dot, through Pinocchio as
// its documentation shows it: default joint types RX and RZ, crba and nonLinearEffects of the full chain, G^T H G
// with the constant matrix G that repeats (alpha_i, beta_i), Eigen's LLT.  pinocchio_chain.cpp has tuned paths.
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
          G(MatrixXd::Zero(model.nv, 6 + 2 * m)), llt(6 + 2 * m)
    {
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
    const VectorXd a = chain.llt.solve(load);
    Vector3d::Map(v_dot) = R * (a.head<3>() + omega.cross(velocity));
    VectorXd::Map(v_dot + 3, 3 + nt) = a.tail(3 + nt);
    return chain.llt.info() == Eigen::Success ? 0 : 1;
}
