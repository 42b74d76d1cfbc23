/* Forward dynamics of a tail in MuJoCo: the full chain of hinges, x and z of every link, its inertia matrix and bias
   force by MuJoCo's functions; then reduced by the constant matrix that repeats (alpha_i, beta_i) over the links of a
   segment, and solved by Cholesky.  Only what forward dynamics needs is called. */
#include <mujoco/mujoco.h>
#include <stdlib.h>
#include <string.h>

struct chain {
    mjModel *model;
    mjData *data;
    int segments, links;
    double *full, *bias, *half, *H;
};

void *mujoco_chain_new(const char *xml, int segments, int links);
void mujoco_chain_free(void *context);
int mujoco_forward_dynamics(void *context, const double *q, const double *v, const double *tau, double *v_dot);

void *mujoco_chain_new(const char *xml, int segments, int links)
{
    char error[500];
    struct chain *chain = calloc(1, sizeof *chain);
    mjModel *model = mj_loadXML(xml, NULL, error, sizeof error);
    if (!chain || !model)
        return NULL;
    const size_t n = (size_t)model->nv, nv = 6 + 2 * (size_t)segments;
    chain->model = model;
    chain->data = mj_makeData(model);
    chain->segments = segments;
    chain->links = links;
    chain->full = calloc(n * n, sizeof(double));
    chain->bias = calloc(n, sizeof(double));
    chain->half = calloc(n * nv, sizeof(double));
    chain->H = calloc(nv * nv, sizeof(double));
    return chain;
}

void mujoco_chain_free(void *context)
{
    struct chain *chain = context;
    mj_deleteData(chain->data);
    mj_deleteModel(chain->model);
    free(chain->full);
    free(chain->bias);
    free(chain->half);
    free(chain->H);
    free(chain);
}

/* the reduced coordinate that full velocity k belongs to */
static int reduced(const struct chain *chain, int k)
{
    return k < 6 ? k : 6 + 2 * ((k - 6) / (2 * chain->links)) + (k - 6) % 2;
}

static int solve(int n, double *A, double *b)
{
    for (int j = 0; j < n; ++j) {
        for (int k = 0; k < j; ++k)
            A[j * n + j] -= A[j * n + k] * A[j * n + k];
        if (!(A[j * n + j] > 0))
            return 1;
        A[j * n + j] = mju_sqrt(A[j * n + j]);
        for (int i = j + 1; i < n; ++i) {
            for (int k = 0; k < j; ++k)
                A[i * n + j] -= A[i * n + k] * A[j * n + k];
            A[i * n + j] /= A[j * n + j];
        }
    }
    for (int i = 0; i < n; ++i) {
        for (int k = 0; k < i; ++k)
            b[i] -= A[i * n + k] * b[k];
        b[i] /= A[i * n + i];
    }
    for (int i = n - 1; i >= 0; --i) {
        for (int k = i + 1; k < n; ++k)
            b[i] -= A[k * n + i] * b[k];
        b[i] /= A[i * n + i];
    }
    return 0;
}

int mujoco_forward_dynamics(void *context, const double *q, const double *v, const double *tau, double *v_dot)
{
    struct chain *chain = context;
    const mjModel *m = chain->model;
    mjData *d = chain->data;
    const int n = (int)m->nv, nv = 6 + 2 * chain->segments;
    memcpy(d->qpos, q, 7 * sizeof(double));
    memcpy(d->qvel, v, 6 * sizeof(double));
    for (int k = 6; k < n; ++k) {
        d->qpos[k + 1] = q[reduced(chain, k) + 1];
        d->qvel[k] = v[reduced(chain, k)];
    }
    mj_kinematics(m, d);
    mj_comPos(m, d);
    mj_makeM(m, d);
    mj_comVel(m, d);
    mj_rne(m, d, 0, chain->bias);
    mj_fullM(m, d, chain->full);
    memset(chain->half, 0, sizeof(double) * (size_t)(n * nv));
    memset(chain->H, 0, sizeof(double) * (size_t)(nv * nv));
    for (int i = 0; i < nv; ++i)
        v_dot[i] = i < 6 ? 0.0 : tau[i - 6];
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j)
            chain->half[i * nv + reduced(chain, j)] += chain->full[i * n + j];
        v_dot[reduced(chain, i)] -= chain->bias[i];
    }
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < nv; ++j)
            chain->H[reduced(chain, i) * nv + j] += chain->half[i * nv + j];
    return solve(nv, chain->H, v_dot);
}
