// From parameters of the articulated tail and states to the Jacobians of v_dot, -H^-1 times those of the inverse
// dynamics at the solved v_dot, through Pinocchio's public functions.  What pinocchio_chain.cpp found fast holds
// here: joint types of the chain alone, Eigen not vectorised, an own LDL^T; the tail is 2 m n revolutes RX and RZ.
//
// All is relative to the torso, as in Pinocchio: the first three rows are those of R^T p_b_ddot.  Columns that need no
// computation (p_b, p_b_dot: zero; a turn of the torso: only R^T g turns) are left out.
#define REVOLUTES
#define BOOST_FUSION_INVOKE_MAX_ARITY 12 // as the build of Pinocchio sets it
#include "pinocchio_chain.hpp"

#include <algorithm>

#include "pinocchio/algorithm/kinematics-derivatives.hpp"
#include "pinocchio/algorithm/rnea-derivatives.hpp"

namespace {

using Matrix6x = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

struct Derivatives : Chain {
    Derivatives(int segments, int links, const Parameters &parameters)
        : Chain(segments, links, parameters), a(VectorXd::Zero(model.nv)), dq(MatrixXd::Zero(model.nv, model.nv)),
          dv(dq), da(dq), X(RowMajor::Zero(BASE + 2 * m, columns()))
    {
    }

    int columns() const { return 6 * m + 3; } // dq: tail; dv: omega, tail; dtau: tail

    VectorXd a;          // of the full chain
    MatrixXd dq, dv, da; // of its inverse dynamics
    RowMajor X;          // reduced right-hand sides, then the result
};

// a of the full chain from the reduced one in x.
void set_acceleration(Derivatives &chain)
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
void subtract_column(Derivatives &chain, const double *entry, int to)
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
void reduce(Derivatives &chain)
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
void solve_all(Derivatives &chain)
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

} // namespace

PEER_API void *pinocchio_chain_new(int segments, int links, const double *parameters)
try {
    return new Derivatives(segments, links, *reinterpret_cast<const Parameters *>(parameters));
} catch (const std::exception &) {
    return nullptr;
}

PEER_API void pinocchio_chain_free(void *chain)
{
    delete static_cast<Derivatives *>(chain);
}

// The latest result: dq, dv (nv x nv) and dtau (nv x 2m), row-major, zero where it was not computed.
PEER_API void pinocchio_derivatives_result(void *context, double *dq, double *dv, double *dtau)
{
    const Derivatives &chain = *static_cast<Derivatives *>(context);
    const int nv = BASE + 2 * chain.m, tail = 2 * chain.m;
    Eigen::Map<RowMajor> of_q(dq, nv, nv), of_v(dv, nv, nv), of_tau(dtau, nv, tail);
    of_q.setZero();
    of_v.setZero();
    of_q.rightCols(tail) = chain.X.leftCols(tail);
    of_v.rightCols(tail + 3) = chain.X.middleCols(tail, tail + 3);
    of_tau = chain.X.rightCols(tail);
}

// Through computeRNEADerivatives of the full chain, H by composite inertias.
PEER_API int pinocchio_forward_dynamics_derivatives(void *context, const double *q, const double *v,
                                                    const double *tau, double *v_dot)
{
    Derivatives &chain = *static_cast<Derivatives *>(context);
    const int status = solve_acceleration(chain, q, v, tau, v_dot);
    set_acceleration(chain);
    pinocchio::computeRNEADerivatives(chain.model, chain.data, chain.q, chain.v, chain.a, chain.dq, chain.dv,
                                      chain.da);
    reduce(chain);
    solve_all(chain);
    return status;
}
