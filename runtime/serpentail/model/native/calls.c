/* Calls of compiled functions on one state, from Python and without its interpreter.

   A call accepts only NumPy arrays of the right type and shape.  For any other argument, and if the
   function refuses the state, it returns None.  Its caller then does the same work in Python, which
   converts arguments and raises errors with a message.  The code uses only CPython's stable ABI, so
   that one build serves every version from 3.11 on, and every NumPy. */

#define Py_LIMITED_API 0x030B0000
#include <Python.h>
#include <string.h>

enum { MOST_ARRAYS = 10 };

typedef int (*Function)(void *record);

/* A function, its argument record, the arrays that the record points to, and their owner. */
typedef struct {
    Function function;
    void *record;
    Py_ssize_t inputs, outputs;
    Py_buffer arrays[MOST_ARRAYS]; /* inputs, then outputs; held, so that they do not move */
    PyObject *copies[MOST_ARRAYS]; /* the method that copies an output; NULL for a scalar */
    PyObject *whole;               /* the index (), of a scalar */
    PyObject *owner;               /* keeps the record, and what it points to, alive */
    int busy;                      /* 1 while a call copies outputs */
} Call;

static const char NAME[] = "serpentail.call";

/* Tell whether an argument is an array of the same type and shape as one of ours. */
static int alike(const Py_buffer *given, const Py_buffer *own)
{
    return given->ndim == own->ndim && strcmp(given->format, own->format) == 0
        && memcmp(given->shape, own->shape, (size_t)own->ndim * sizeof *own->shape) == 0;
}

/* Copy an argument into the array that the function reads; 0 if it needs Python's conversion. */
static int copy_in(PyObject *argument, const Py_buffer *own)
{
    Py_buffer given;
    int plain;
    if (Py_TYPE(argument) != Py_TYPE(own->obj)) { /* subclasses may be masked, or matrices */
        return 0;
    }
    if (PyObject_GetBuffer(argument, &given, PyBUF_RECORDS_RO) < 0) {
        PyErr_Clear();
        return 0;
    }
    plain = alike(&given, own) && PyBuffer_ToContiguous(own->buf, &given, own->len, 'C') == 0;
    PyBuffer_Release(&given);
    return plain;
}

/* Return a new copy of output k. */
static PyObject *copy_of(const Call *call, Py_ssize_t k)
{
    if (call->copies[k] != NULL) {
        return PyObject_CallNoArgs(call->copies[k]);
    }
    return PyObject_GetItem(call->arrays[call->inputs + k].obj, call->whole);
}

/* Return new copies of all outputs: a single one, or a tuple. */
static PyObject *results(const Call *call)
{
    Py_ssize_t k;
    PyObject *all, *one;
    if (call->outputs == 1) {
        return copy_of(call, 0);
    }
    all = PyTuple_New(call->outputs);
    for (k = 0; all != NULL && k < call->outputs; k++) {
        one = copy_of(call, k);
        if (one == NULL || PyTuple_SetItem(all, k, one) < 0) {
            Py_DECREF(all);
            return NULL;
        }
    }
    return all;
}

/* Evaluate the function on one state.  Python's lock is held from the first argument to the last
   result, with two exceptions: NumPy releases it to copy large arrays, and Python's garbage
   collection may run code of the user.  Another call at such a time finds this one busy and is made
   in Python. */
static PyObject *evaluate(PyObject *self, PyObject *const *arguments, Py_ssize_t count)
{
    Call *call = PyCapsule_GetPointer(self, NAME);
    PyObject *found;
    Py_ssize_t k;
    if (call == NULL) {
        return NULL;
    }
    if (count != call->inputs || call->busy) {
        Py_RETURN_NONE;
    }
    for (k = 0; k < count; k++) {
        if (!copy_in(arguments[k], &call->arrays[k])) {
            Py_RETURN_NONE;
        }
    }
    if (call->function(call->record) != 0) {
        Py_RETURN_NONE;
    }
    call->busy = 1;
    found = results(call);
    call->busy = 0;
    return found;
}

static void release(PyObject *capsule)
{
    Call *call = PyCapsule_GetPointer(capsule, NAME);
    Py_ssize_t k;
    for (k = 0; k < MOST_ARRAYS; k++) {
        PyBuffer_Release(&call->arrays[k]); /* does nothing if none is held */
        Py_XDECREF(call->copies[k]);
    }
    Py_XDECREF(call->whole);
    Py_XDECREF(call->owner);
    PyMem_Free(call);
}

/* Hold the arrays and the methods that copy the outputs; return -1 and set an error on failure. */
static int hold(Call *call, PyObject *arrays)
{
    Py_ssize_t k;
    PyObject *array;
    for (k = 0; k < call->inputs + call->outputs; k++) {
        array = PyTuple_GetItem(arrays, k);
        if (array == NULL || PyObject_GetBuffer(array, &call->arrays[k], PyBUF_RECORDS) < 0) {
            return -1;
        }
        if (k >= call->inputs && call->arrays[k].ndim > 0) {
            call->copies[k - call->inputs] = PyObject_GetAttrString(array, "copy");
            if (call->copies[k - call->inputs] == NULL) {
                return -1;
            }
        }
    }
    call->whole = PyTuple_New(0);
    return call->whole == NULL ? -1 : 0;
}

static PyMethodDef METHOD = {"evaluate", (PyCFunction)(void (*)(void))evaluate, METH_FASTCALL, NULL};

/* Return a callable that evaluates a function.  arrays: inputs first, then outputs; the argument
   record points to them.  The callable keeps the owner of both; the function must outlive it. */
PyObject *serpentail_call(
    void *function, void *record, PyObject *arrays, Py_ssize_t inputs, PyObject *owner)
{
    PyObject *capsule, *made;
    Call *call = PyMem_Calloc(1, sizeof *call);
    if (call == NULL) {
        return PyErr_NoMemory();
    }
    call->function = (Function)(size_t)function;
    call->record = record;
    call->inputs = inputs;
    Py_INCREF(owner);
    call->owner = owner;
    call->outputs = PyTuple_Size(arrays) - inputs;
    capsule = PyCapsule_New(call, NAME, release);
    if (capsule == NULL) {
        Py_DECREF(owner);
        PyMem_Free(call);
        return NULL;
    }
    made = hold(call, arrays) < 0 ? NULL : PyCFunction_New(&METHOD, capsule);
    Py_DECREF(capsule);
    return made;
}
