// Calls of models' C by XLA on the CPU: arrays of any leading shape, in lanes and threads.  A state that the model refuses
// has nan in all its results.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <unordered_map>
#include <vector>

#include "xla/ffi/api/ffi.h"

namespace ffi = xla::ffi;

namespace {

constexpr size_t kArrays = 10, kLine = 64;

// A call of the generated C, as its host entries take it.
struct Call {
  const void *parameters;
  size_t count, failed;
  void *work;
  void *arrays[kArrays];
};

using Function = int (*)(Call *);

// A function of a model: for states one by one, and several at once where `many` is there.
struct Entry {
  Function single, many;
  const void *parameters;
  size_t single_work, many_work;  // bytes
  size_t states;                      // at once
  size_t bytes;                       // of a number
  size_t least;                       // states that are worth a thread
  size_t threads;
};

std::mutex lock;
std::unordered_map<std::string, Entry> entries;

struct Free {
  void operator()(void *memory) const { std::free(memory); }
};
using Memory = std::unique_ptr<void, Free>;

Memory aligned(size_t bytes) { return Memory(std::aligned_alloc(kLine, (bytes / kLine + 2) * kLine)); }

// Arrays of many states, a row of each.
struct Arrays {
  std::vector<char *> data;
  std::vector<size_t> row;  // bytes
  size_t inputs;

  Call from(const Entry &entry, size_t first, size_t count, void *work) const {
    Call call{entry.parameters, count, 0, work, {}};
    for (size_t k = 0; k < data.size(); ++k) {
      call.arrays[k] = data[k] + first * row[k];
    }
    return call;
  }

  void refuse(const Entry &entry, size_t state) const {
    for (size_t k = inputs; k < data.size(); ++k) {
      char *const place = data[k] + state * row[k];
      if (entry.bytes == sizeof(double)) {
        std::fill_n(reinterpret_cast<double *>(place), row[k] / sizeof(double), std::numeric_limits<double>::quiet_NaN());
      } else {
        std::fill_n(reinterpret_cast<float *>(place), row[k] / sizeof(float), std::numeric_limits<float>::quiet_NaN());
      }
    }
  }
};

// States [first, last); those among which one fails in lanes are evaluated again, one by one.
void evaluate(const Entry &entry, const Arrays &arrays, size_t first, size_t last) {
  const Memory single = aligned(entry.single_work), many = aligned(entry.many_work);
  while (first < last) {
    const bool lanes = entry.many && last - first >= entry.states;
    Call call = arrays.from(entry, first, last - first, lanes ? many.get() : single.get());
    if ((lanes ? entry.many : entry.single)(&call) == 0) {
      return;
    }
    first += call.failed;
    const size_t after = lanes ? std::min(first + entry.states, last) : first + 1;
    for (; first < after; ++first) {
      Call one = arrays.from(entry, first, 1, single.get());
      if (entry.single(&one) != 0) {
        arrays.refuse(entry, first);
      }
    }
  }
}

void evaluate_in_threads(const Entry &entry, const Arrays &arrays, size_t count) {
  const size_t shares = std::max<size_t>(1, std::min(entry.threads, count / entry.least));
  std::vector<std::thread> others;
  for (size_t k = 1; k < shares; ++k) {
    others.emplace_back([&, k] { evaluate(entry, arrays, count * k / shares, count * (k + 1) / shares); });
  }
  evaluate(entry, arrays, 0, count / shares);
  for (std::thread &other : others) {
    other.join();
  }
}

ffi::Error call(ffi::RemainingArgs inputs, ffi::RemainingRets outputs, std::string_view name) {
  Entry entry;
  {
    const std::lock_guard<std::mutex> guard(lock);
    const auto found = entries.find(std::string(name));
    if (found == entries.end()) {
      return ffi::Error(ffi::ErrorCode::kNotFound, "serpentail: this process has not loaded the model of " + std::string(name));
    }
    entry = found->second;
  }
  // every array is rows of as many states as the first one
  size_t count = 1;
  const auto leading = inputs.get<ffi::AnyBuffer>(0)->dimensions();
  for (size_t axis = 0; axis + 1 < leading.size(); ++axis) {
    count *= static_cast<size_t>(leading[axis]);
  }
  Arrays arrays{{}, {}, inputs.size()};
  const auto add = [&](ffi::AnyBuffer buffer) {
    arrays.data.push_back(static_cast<char *>(buffer.untyped_data()));
    arrays.row.push_back(count ? buffer.element_count() / count * entry.bytes : 0);
  };
  for (size_t k = 0; k < inputs.size(); ++k) {
    add(*inputs.get<ffi::AnyBuffer>(k));
  }
  for (size_t k = 0; k < outputs.size(); ++k) {
    add(**outputs.get<ffi::AnyBuffer>(k));
  }
  evaluate_in_threads(entry, arrays, count);
  return ffi::Error::Success();
}

}  // namespace

extern "C" void serpentail_enter(const char *name, const Entry *entry) {
  const std::lock_guard<std::mutex> guard(lock);
  entries[name] = *entry;
}

XLA_FFI_DEFINE_HANDLER_SYMBOL(
    serpentail_call, call,
    ffi::Ffi::Bind().RemainingArgs().RemainingRets().Attr<std::string_view>("name"));
