// From parameters of the articulated tail and states in this project's conventions to H, C and v_dot, by the
// fastest path found through Pinocchio's public functions: the peer of the generated code.
//
// The chain is a free-flyer and m n universal joints (x, then z), 2 m n tail coordinates in all; the constant
// matrix G repeats (alpha_i, beta_i) over the links of segment i: H = G^T H_full G, C = G^T C_full.
//
// What was tried: ns at (1,3), (3,4), (6,6), minimum over interleaved rounds; Pinocchio 4.1, Eigen 3.4,
// gcc 12, one core of an AMD Zen 5 with AVX-512.  The first two are here.
//    588  1729  4704  composite: nonLinearEffects, then, on the same joint data, updateGlobalPlacements and
//                     computeJointJacobians, and composite inertias times the Jacobian's columns, summed
//    652  2611 11407  CRBA: crba and nonLinearEffects, the blocks of H_full summed; LOCAL for short chains
//    639  2804 11270  CRBA on 2 m n revolutes that take (cos, sin), RUBX and RUBZ: one sincos a segment
//    756  3252 12934  CRBA on 2 m n revolutes RX and RZ
//    636  2071  5640  composite on 2 m n revolutes RX and RZ
//    716  2165  5741  computeCentroidalMap for the columns: the kinematics are computed twice
//    599  1725  4521  visitors of one's own, inertias and bias in one sweep
//   1239  3881 13825  computeAllTerms
//   1518  6382 28530  mimic joints, which need no G, and all joint types
//   1572  5871 17669  CRBA on RX and RZ as it comes: all joint types, Eigen vectorised and its LLT, plain -O3
// What single choices add, each measured on one of these paths:
//   Eigen vectorised (3-vectors and 6-vectors in 512-bit packets)  +105 %;  gcc's own inlining limits  +19 %
//   all 25 joint types in the variant  +23 to +31 %;  SLP vectoriser  +8 %;  -O2  0 to +3 %
//   Eigen's LLT  +41, +20, +9 %, of fixed size  +17, +20, +12 %, instead of the LDL^T below
//   G^T H_full G by dense products  +26, +25, +49 %;  rnea at v_dot = 0 for nonLinearEffects  0 to +2 %
#include "pinocchio_chain.hpp"

#include "pinocchio/algorithm/crba.hpp"

namespace {

constexpr int LONGEST_FOR_LOCAL = 16; // links up to which CRBA is faster in LOCAL convention than in WORLD

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

} // namespace

// From gravity, torso_mass, torso_inertia (3), tail_mount (3), tail_mass, tail_length, link_inertia (3) to a
// chain, or to a null pointer where it cannot be built.
PEER_API void *pinocchio_chain_new(int segments, int links, const double *parameters)
{
    static_assert(sizeof(Parameters) == 13 * sizeof(double), "parameters are an array of 13");
    try {
        return new Chain(segments, links, *reinterpret_cast<const Parameters *>(parameters));
    } catch (const std::exception &) {
        return nullptr;
    }
}

PEER_API void pinocchio_chain_free(void *chain)
{
    delete static_cast<Chain *>(chain);
}

// v_dot by the fastest path; 0, or 1 where H is not positive definite.  The quaternion in q is a unit one.
PEER_API int pinocchio_forward_dynamics(void *context, const double *q, const double *v, const double *tau,
                                        double *v_dot)
{
    return solve_acceleration(*static_cast<Chain *>(context), q, v, tau, v_dot);
}

// v_dot by Pinocchio's CRBA on the full chain; else as above.
PEER_API int pinocchio_forward_dynamics_crba(void *context, const double *q, const double *v,
                                             const double *tau, double *v_dot)
{
    Chain &chain = *static_cast<Chain *>(context);
    set_configuration(chain, q);
    set_velocity(chain, v);
    crba_mass_matrix(chain);
    bias_force(chain);
    return accelerate(chain, q, tau, v_dot);
}

// H (nv x nv), row-major, by the fastest path.
PEER_API int pinocchio_mass_matrix(void *context, const double *q, double *H)
{
    Chain &chain = *static_cast<Chain *>(context);
    set_configuration(chain, q);
    chain.v.setZero();
    bias_force(chain);
    composite_mass_matrix(chain);
    const auto size = chain.H.rows();
    Eigen::Map<RowMajor> out(H, size, size);
    out = chain.H.selfadjointView<Eigen::Lower>();
    const Eigen::Matrix3d R = Quaterniond(q[3], q[4], q[5], q[6]).toRotationMatrix();
    out.topRows<3>() = (R * out.topRows<3>()).eval();
    out.leftCols<3>() = (out.leftCols<3>() * R.transpose()).eval();
    return 0;
}

// C (nv), gravity included.
PEER_API int pinocchio_bias_force(void *context, const double *q, const double *v, double *C)
{
    Chain &chain = *static_cast<Chain *>(context);
    set_configuration(chain, q);
    set_velocity(chain, v);
    bias_force(chain);
    VectorXd::Map(C, chain.x.size()) = chain.x;
    Vector3d::Map(C) = Quaterniond(q[3], q[4], q[5], q[6]) * chain.x.head<3>();
    return 0;
}
