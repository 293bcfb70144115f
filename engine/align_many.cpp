// Many pairs, one per thread at a time.
#include <algorithm>
#include <utility>

#include "engine/options.hpp"
#include "engine/parallel.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg {
namespace detail {

struct BatchState {
  BatchState(const Model& model, Options options) {
    check_threads(options.threads);
    threads = thread_count(options.threads);
    if (options.record_stages) {
      throw Error(ErrorCode::invalid_option, "record_stages", "false in a batch", "true");
    }
    options.threads = 1;
    for (int i = 0; i < threads; ++i) registrars.emplace_back(model, options);
  }

  int threads = 1;
  std::vector<Registrar> registrars;
};

}  // namespace detail

// The constructors of the API take the model by value.
// NOLINTNEXTLINE(performance-unnecessary-value-param)
BatchRegistrar::BatchRegistrar(Model model, Options options)
    : state_(std::make_unique<detail::BatchState>(model, options)) {}

BatchRegistrar::~BatchRegistrar() = default;
BatchRegistrar::BatchRegistrar(BatchRegistrar&&) noexcept = default;
BatchRegistrar& BatchRegistrar::operator=(BatchRegistrar&&) noexcept = default;

void BatchRegistrar::align_many(std::span<const CloudPair> pairs,
                                std::span<Result> results) noexcept {
  detail::BatchState& s = *state_;
  const std::size_t count = std::min(pairs.size(), results.size());
  detail::parallel_for(s.threads, static_cast<detail::Index>(count), [&](auto index, int thread) {
    const auto i = static_cast<std::size_t>(index);
    Registrar& registrar = s.registrars[static_cast<std::size_t>(thread)];
    results[i] = registrar.align(pairs[i].source, pairs[i].target);
  });
}

PreparedCloud BatchRegistrar::prepare(PointsView cloud) {
  return state_->registrars.front().prepare(cloud);
}

int BatchRegistrar::threads() const noexcept { return state_->threads; }

}  // namespace vnreg
