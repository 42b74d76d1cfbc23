// From parameters of the articulated tail and states to the Jacobians of v_dot: -H^-1 times those of the inverse
// dynamics at the solved v_dot, through Pinocchio's public functions.  What pinocchio_chain.cpp found fast holds
// here: joint types of the chain alone, Eigen not vectorised, an own LDL^T; the tail is 2 m n revolutes RX and RZ.
//
// All is relative to the torso, as in Pinocchio: the first three rows are those of R^T p_b_ddot.  Columns that need no
// computation (p_b, p_b_dot: zero; a turn of the torso: only R^T g turns) are left out.
//
// What was tried: ns at (1,3), (3,4), (6,6), as in pinocchio_chain.cpp.  The first two are in this file.
//   3390  12800  58000  computeRNEADerivatives of the full chain, sums of its blocks
//   2050   5900  16900  its columns in world axes, summed over each segment before they are multiplied
//   7000  24000 166000  as the documentation shows it (pinocchio_plain.cpp)
// What single choices add to the first: Eigen vectorised in 512-bit packets  +75, +45, +35 %, in 256-bit packets  +75,
// +45, +10 %;  SLP vectoriser  +3 to +23 %;  larger inlining limits, columns added before rows  0 %.
#define REVOLUTES
#define BOOST_FUSION_INVOKE_MAX_ARITY 12 // as the build of Pinocchio sets it
#include "pinocchio_chain.hpp"

#include <vector>

#include "pinocchio/algorithm/kinematics-derivatives.hpp"
#include "pinocchio/algorithm/rnea-derivatives.hpp"

namespace {

using pinocchio::Force;
using pinocchio::Motion;

// One tail coordinate in world axes, or the sum over those that are tied: the axis S, what its velocity and
// acceleration do to those behind it, and the forces that a change of it and of its rate needs.
struct Columns {
    Matrix62 S, dV, dA, Fa, Fq, Fv, T;
};

// What is behind a joint: composite inertia, its rate together with the momentum's, force.
struct Behind {
    Inertia Y = Inertia::Zero();
    Matrix66 B = Matrix66::Zero();
    Force f = Force::Zero();
};

struct Derivatives : Chain {
    Derivatives(int segments, int links, const Parameters &parameters)
        : Chain(segments, links, parameters), a(VectorXd::Zero(model.nv)), dq(MatrixXd::Zero(model.nv, model.nv)),
          dv(dq), da(dq), X(RowMajor::Zero(BASE + 2 * m, columns())), column(m * n), segment(m), bodies(m * n + 1)
    {
    }

    int columns() const { return 6 * m + 3; } // dq: tail; dv: omega, tail; dtau: tail

    VectorXd a;          // of the full chain
    MatrixXd dq, dv, da; // of its inverse dynamics
    RowMajor X;          // reduced right-hand sides, then the result
    std::vector<Columns> column, segment; // of links; sums over segments
    std::vector<Behind> bodies;           // torso, links
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

Behind moving(const Inertia &Y, const Motion &velocity, const Motion &acceleration)
{
    Behind body;
    const Force h = Y * velocity;
    body.Y = Y;
    body.f = Y * acceleration + velocity.cross(h);
    body.B = Y.variation(velocity);
    pinocchio::addSkew(-h.linear(), body.B.block<3, 3>(0, 3));
    pinocchio::addSkew(-h.linear(), body.B.block<3, 3>(3, 0));
    pinocchio::addSkew(-h.angular(), body.B.block<3, 3>(3, 3));
    return body;
}

// Columns and bodies from the torso to the tip, on the placements and the Jacobian in data.
void sweep_out(Derivatives &chain)
{
    const Data &data = chain.data;
    const auto J = data.J.leftCols<BASE>();
    Motion velocity(J * chain.v.head<BASE>()), acceleration(J * chain.x.head<BASE>());
    acceleration -= chain.model.gravity;
    chain.bodies[0] = moving(data.oMi[TORSO].act(chain.model.inertias[TORSO]), velocity, acceleration);
    for (int link = 0; link < chain.m * chain.n; ++link) {
        Columns &c = chain.column[link];
        c.S = data.J.middleCols<2>(BASE + 2 * link);
        for (int side = 0; side < 2; ++side) {
            const int row = BASE + 2 * (link / chain.n) + side;
            const Motion S(c.S.col(side)), dV = velocity.cross(S);
            c.dV.col(side) = dV.toVector();
            c.dA.col(side) = (acceleration.cross(S) + velocity.cross(dV)).toVector();
            acceleration += S * chain.x[row] + dV * chain.v[BASE + 2 * link + side];
            velocity += S * chain.v[BASE + 2 * link + side];
        }
        const int joint = joint_of(link);
        chain.bodies[link + 1] = moving(data.oMi[joint].act(chain.model.inertias[joint]), velocity, acceleration);
    }
}

// Forces on the columns of one link, whose own body and those behind it are in `behind`.
void column_forces(Columns &c, const Behind &behind)
{
    const Matrix66 Y = behind.Y.matrix();
    c.Fa.noalias() = Y * c.S;
    c.T.noalias() = behind.B.transpose() * c.S;
    c.Fq.noalias() = Y * c.dA + behind.B * c.dV;
    for (int side = 0; side < 2; ++side)
        c.Fq.col(side) += Motion(c.S.col(side)).cross(behind.f).toVector();
    c.Fv.noalias() = 2 * Y * c.dV + behind.B * c.S;
}

// Rows of one coordinate by columns of one that is behind it or the same.
template <typename A, typename B> void ahead(Derivatives &chain, int row, int col, const A &S, const B &c, int side)
{
    chain.X(row, col) -= S.dot(c.Fq.col(side));
    chain.X(row, col + 2 * chain.m + 3) -= S.dot(c.Fv.col(side));
}

// Rows of one coordinate by columns of one that is ahead of it.
void back(Derivatives &chain, int row, int col, const Columns &r, int of_row, const Columns &c, int side)
{
    chain.X(row, col) -= r.Fa.col(of_row).dot(c.dA.col(side)) + r.T.col(of_row).dot(c.dV.col(side));
    chain.X(row, col + 2 * chain.m + 3) -=
        2 * r.Fa.col(of_row).dot(c.dV.col(side)) + r.T.col(of_row).dot(c.S.col(side));
}

// Columns of segment i summed; its own block of X.
void sum_segment(Derivatives &chain, int i, Behind &behind)
{
    Columns &sum = chain.segment[i];
    for (Matrix62 *part : {&sum.S, &sum.dV, &sum.dA, &sum.Fa, &sum.Fq, &sum.Fv, &sum.T})
        part->setZero();
    for (int link = (i + 1) * chain.n - 1; link >= i * chain.n; --link) {
        const Behind &body = chain.bodies[link + 1];
        behind.Y += body.Y;
        behind.B += body.B;
        behind.f += body.f;
        Columns &c = chain.column[link];
        column_forces(c, behind);
        for (int side = 1; side >= 0; --side) {
            const int first = 2 * i, row = BASE + first;
            for (int other = 0; other < 2; ++other)
                back(chain, row + other, first + side, sum, other, c, side);
            sum.Fq.col(side) += c.Fq.col(side);
            sum.Fv.col(side) += c.Fv.col(side);
            for (int other = 0; other < 2; ++other)
                ahead(chain, row + side, first + other, c.S.col(side), sum, other);
            sum.Fa.col(side) += c.Fa.col(side);
            sum.T.col(side) += c.T.col(side);
        }
        sum.S += c.S;
        sum.dV += c.dV;
        sum.dA += c.dA;
    }
}

// X as of reduce(), by sums over the tied columns.
void sum_columns(Derivatives &chain)
{
    const int tail = 2 * chain.m;
    chain.X.setZero();
    sweep_out(chain);
    Behind behind;
    for (int i = chain.m - 1; i >= 0; --i)
        sum_segment(chain, i, behind);
    for (int i = 0; i < chain.m; ++i)
        for (int k = i + 1; k < chain.m; ++k)
            for (int a = 0; a < 2; ++a)
                for (int b = 0; b < 2; ++b) {
                    ahead(chain, BASE + 2 * i + a, 2 * k + b, chain.segment[i].S.col(a), chain.segment[k], b);
                    back(chain, BASE + 2 * k + a, 2 * i + b, chain.segment[k], a, chain.segment[i], b);
                }
    const Matrix66 J = chain.data.J.leftCols<BASE>();
    for (int i = 0; i < chain.m; ++i) {
        chain.X.block<BASE, 2>(0, 2 * i).noalias() = -J.transpose() * chain.segment[i].Fq;
        chain.X.block<BASE, 2>(0, tail + 3 + 2 * i).noalias() = -J.transpose() * chain.segment[i].Fv;
    }
    const Behind &torso = chain.bodies[0];
    const Eigen::Matrix<double, 6, 3> omega = J.rightCols<3>();
    Eigen::Matrix<double, 6, 3> rate;
    pinocchio::motionSet::motionAction(Motion(J * chain.v.head<BASE>()), omega, rate);
    for (int i = 0; i < chain.m; ++i)
        chain.X.block<2, 3>(BASE + 2 * i, tail).noalias() =
            -(chain.segment[i].Fa.transpose() * rate + chain.segment[i].T.transpose() * omega);
    chain.X.block<BASE, 3>(0, tail).noalias() =
        -J.transpose() * ((behind.Y + torso.Y).matrix() * rate + (behind.B + torso.B) * omega);
    for (int k = 0; k < tail; ++k)
        chain.X(BASE + k, 2 * tail + 3 + k) = 1;
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

// By sums over the tied columns on Pinocchio's types; else as above.
PEER_API int pinocchio_forward_dynamics_derivatives_own(void *context, const double *q, const double *v,
                                                        const double *tau, double *v_dot)
{
    Derivatives &chain = *static_cast<Derivatives *>(context);
    const int status = solve_acceleration(chain, q, v, tau, v_dot);
    sum_columns(chain);
    solve_all(chain);
    return status;
}
