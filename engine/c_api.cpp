// The C API: every function turns its arguments into those of the C++ API, and exceptions into
// codes.
#include <algorithm>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vnreg/vnreg.h"
#include "vnreg/vnreg.hpp"

struct vnreg_model {
  vnreg::Model model;
  std::string name;
};
struct vnreg_prepared {
  vnreg::PreparedCloud cloud;
};
struct vnreg_cancellation {
  vnreg::Cancellation flag;
};
struct vnreg_registrar {
  vnreg::Registrar registrar;
};
struct vnreg_batch {
  vnreg::BatchRegistrar batch;
  // Of the last call, kept for the next one.
  std::vector<vnreg::CloudPair> pairs;
  std::vector<vnreg::Result> results;
};

namespace vnreg {
namespace {

static_assert(VNREG_MODE_VERIFIED == static_cast<int>(Mode::verified));
static_assert(VNREG_STATUS_SCALES_DIFFER == static_cast<int>(Status::scales_differ));
static_assert(VNREG_INVALID_POINTS == 1 + static_cast<int>(ErrorCode::invalid_points));
static_assert(VNREG_MOST_ALTERNATIVES == Alternatives::capacity);

/// As much as fits, and a final zero.
template <std::size_t size>
void copy_text(std::string_view text, char (&buffer)[size]) noexcept {
  const std::size_t length = std::min(text.size(), size - 1);
  std::memcpy(buffer, text.data(), length);
  buffer[length] = '\0';
}

vnreg_code fail(vnreg_code code, std::string_view field, std::string_view expected,
                std::string_view got, std::string_view message, vnreg_error* error) noexcept {
  if (error != nullptr) {
    error->code = code;
    copy_text(field, error->field);
    copy_text(expected, error->expected);
    copy_text(got, error->got);
    copy_text(message, error->message);
  }
  return code;
}

struct NullArgument {
  const char* name;
};

vnreg_code report(vnreg_error* error) noexcept {
  try {
    throw;
  } catch (const NullArgument& e) {
    return fail(VNREG_NULL_ARGUMENT, e.name, "a pointer", "NULL", "a pointer is NULL", error);
  } catch (const Error& e) {
    return fail(1 + static_cast<vnreg_code>(e.code()), e.field(), e.expected(), e.got(), e.what(),
                error);
  } catch (const std::bad_alloc&) {
    return fail(VNREG_OUT_OF_MEMORY, "memory", "enough", "too little", "out of memory", error);
  } catch (const std::exception& e) {
    return fail(VNREG_UNEXPECTED, "", "", "", e.what(), error);
  } catch (...) {
    return fail(VNREG_UNEXPECTED, "", "", "", "unknown exception", error);
  }
}

/// Runs the body of a function of the API.
template <class Body>
vnreg_code guarded(vnreg_error* error, const Body& body) noexcept {
  if (error != nullptr) *error = vnreg_error{};
  try {
    body();
    return VNREG_OK;
  } catch (...) {
    return report(error);
  }
}

template <class T>
T& required(T* pointer, const char* name) {
  if (pointer == nullptr) throw NullArgument{name};
  return *pointer;
}

const Model& model_or_builtin(const vnreg_model* model) {
  if (model != nullptr) return model->model;
  static const Model builtin = Model::builtin();
  return builtin;
}

Options options_or_default(const vnreg_options* o) noexcept {
  Options options;
  if (o == nullptr) return options;
  options.mode = static_cast<Mode>(o->mode);
  options.threads = o->threads;
  options.max_points = o->max_points;
  options.seed = o->seed;
  options.record_stages = o->record_stages != 0;
  options.time_budget_ms = o->time_budget_ms;
  options.cancellation = o->cancellation == nullptr ? nullptr : &o->cancellation->flag;
  options.drop_non_finite = o->drop_non_finite != 0;
  return options;
}

template <class Scalar>
PointsView view(const vnreg_cloud& c) noexcept {
  const std::size_t axis_stride = c.axis_stride_bytes == 0 ? sizeof(Scalar) : c.axis_stride_bytes;
  const std::size_t stride = c.stride_bytes == 0 ? 3 * sizeof(Scalar) : c.stride_bytes;
  return {static_cast<const Scalar*>(c.data), c.count, stride, axis_stride};
}

PointsView points_of(const vnreg_cloud& c) {
  if (c.scalar == VNREG_FLOAT32) return view<float>(c);
  if (c.scalar == VNREG_FLOAT64) return view<double>(c);
  throw Error(ErrorCode::invalid_points, "scalar", "VNREG_FLOAT32 or VNREG_FLOAT64",
              std::to_string(c.scalar));
}

CloudRef cloud_of(const vnreg_cloud& c) {
  if (c.prepared != nullptr) return c.prepared->cloud;
  return points_of(c);
}

template <std::size_t size>
void copy(const std::array<double, size>& from, double (&to)[size]) noexcept {
  std::copy(from.begin(), from.end(), to);
}

vnreg_evidence c_evidence(const Evidence& e) noexcept {
  return {e.score, e.margin, e.covered, e.contradicted, e.beyond, e.residual, e.noise, e.certainty};
}

vnreg_times c_times(const StageTimes& t) noexcept {
  return {t.prepare, t.encode, t.coarse, t.fine, t.hypotheses, t.verify, t.measure, t.total};
}

void copy_result(const Result& r, vnreg_result& out) noexcept {
  out = vnreg_result{};
  out.status = static_cast<vnreg_status>(r.status);
  out.has_pose = r.has_pose;
  copy(r.T_target_source, out.T_target_source);
  copy(r.T_target_source_coarse, out.T_target_source_coarse);
  copy(r.covariance, out.covariance);
  out.confidence = r.confidence;
  out.overlap = r.overlap;
  out.rmse = r.rmse;
  out.inlier_distance = r.inlier_distance;
  out.score = r.score;
  out.alternative_count = r.alternatives.size();
  for (std::size_t i = 0; i < r.alternatives.size(); ++i) {
    copy(r.alternatives[i].T_target_source, out.alternatives[i].T_target_source);
    out.alternatives[i].score = r.alternatives[i].score;
  }
  out.evidence = c_evidence(r.evidence);
  out.points_source = r.points_source;
  out.points_target = r.points_target;
  out.dropped_source = r.dropped_source;
  out.dropped_target = r.dropped_target;
  out.ms = c_times(r.ms);
}

void make_model(Model model, vnreg_model** out) {
  std::string name(model.name());
  *out = new vnreg_model{std::move(model), std::move(name)};
}

}  // namespace
}  // namespace vnreg

using vnreg::guarded;
using vnreg::required;

// The words of the API are literals: their data ends with a zero.
const char* vnreg_version() { return vnreg::version().data(); }
const char* vnreg_instruction_set() { return vnreg::instruction_set().data(); }
const char* vnreg_mode_name(vnreg_mode mode) {
  return vnreg::to_string(static_cast<vnreg::Mode>(mode)).data();
}
const char* vnreg_status_name(vnreg_status status) {
  return vnreg::to_string(static_cast<vnreg::Status>(status)).data();
}
const char* vnreg_code_name(vnreg_code code) {
  switch (code) {
    case VNREG_OK:
      return "ok";
    case VNREG_NULL_ARGUMENT:
      return "null_argument";
    case VNREG_OUT_OF_MEMORY:
      return "out_of_memory";
    case VNREG_UNEXPECTED:
      return "unexpected";
    default:
      return vnreg::to_string(static_cast<vnreg::ErrorCode>(code - 1)).data();
  }
}

vnreg_cloud vnreg_cloud_f32(const float* xyz, size_t count) {
  return {xyz, count, 0, 0, VNREG_FLOAT32, nullptr};
}
vnreg_cloud vnreg_cloud_f64(const double* xyz, size_t count) {
  return {xyz, count, 0, 0, VNREG_FLOAT64, nullptr};
}
vnreg_cloud vnreg_cloud_prepared(const vnreg_prepared* prepared) {
  return {nullptr, 0, 0, 0, VNREG_FLOAT32, prepared};
}

vnreg_code vnreg_model_load(const char* path, vnreg_model** model, vnreg_error* error) {
  return guarded(error, [&] {
    required(model, "model") = nullptr;
    vnreg::make_model(vnreg::Model::load(&required(path, "path")), model);
  });
}
vnreg_code vnreg_model_from_bytes(const void* bytes, size_t size, vnreg_model** model,
                                  vnreg_error* error) {
  return guarded(error, [&] {
    required(model, "model") = nullptr;
    const auto* first = &required(static_cast<const std::byte*>(bytes), "bytes");
    vnreg::make_model(vnreg::Model::from_bytes({first, size}), model);
  });
}
vnreg_code vnreg_model_builtin(vnreg_model** model, vnreg_error* error) {
  return guarded(error, [&] {
    required(model, "model") = nullptr;
    vnreg::make_model(vnreg::model_or_builtin(nullptr), model);
  });
}
const char* vnreg_model_name(const vnreg_model* model) { return model->name.c_str(); }
int32_t vnreg_model_points(const vnreg_model* model) { return model->model.points(); }
int32_t vnreg_model_min_points(const vnreg_model* model) { return model->model.min_points(); }
void vnreg_model_free(vnreg_model* model) { delete model; }

vnreg_code vnreg_align(vnreg_cloud source, vnreg_cloud target, const vnreg_options* options,
                       vnreg_result* result, vnreg_error* error) {
  return guarded(error, [&] {
    vnreg_result& out = required(result, "result");
    vnreg::Registrar registrar(vnreg::model_or_builtin(nullptr),
                               vnreg::options_or_default(options));
    vnreg::copy_result(registrar.align(vnreg::cloud_of(source), vnreg::cloud_of(target)), out);
  });
}

vnreg_code vnreg_registrar_create(const vnreg_model* model, const vnreg_options* options,
                                  vnreg_registrar** registrar, vnreg_error* error) {
  return guarded(error, [&] {
    required(registrar, "registrar") = nullptr;
    *registrar = new vnreg_registrar{
        vnreg::Registrar(vnreg::model_or_builtin(model), vnreg::options_or_default(options))};
  });
}
vnreg_code vnreg_registrar_align(vnreg_registrar* registrar, vnreg_cloud source, vnreg_cloud target,
                                 vnreg_result* result, vnreg_error* error) {
  return guarded(error, [&] {
    vnreg_result& out = required(result, "result");
    vnreg::Registrar& r = required(registrar, "registrar").registrar;
    vnreg::copy_result(r.align(vnreg::cloud_of(source), vnreg::cloud_of(target)), out);
  });
}
vnreg_code vnreg_registrar_prepare(vnreg_registrar* registrar, vnreg_cloud cloud,
                                   vnreg_prepared** prepared, vnreg_error* error) {
  return guarded(error, [&] {
    required(prepared, "prepared") = nullptr;
    vnreg::Registrar& r = required(registrar, "registrar").registrar;
    *prepared = cloud.prepared != nullptr ? new vnreg_prepared(*cloud.prepared)
                                          : new vnreg_prepared{r.prepare(vnreg::points_of(cloud))};
  });
}
void vnreg_registrar_free(vnreg_registrar* registrar) { delete registrar; }

size_t vnreg_registrar_stage_count(const vnreg_registrar* registrar) {
  return registrar->registrar.stages().size();
}
vnreg_stage vnreg_registrar_stage(const vnreg_registrar* registrar, size_t index) {
  const std::vector<vnreg::Stage>& stages = registrar->registrar.stages();
  if (index >= stages.size()) return {nullptr, nullptr, 0, nullptr, 0};
  const vnreg::Stage& s = stages[index];
  return {s.name.c_str(), s.shape.data(), s.shape.size(), s.values.data(), s.values.size()};
}

vnreg_code vnreg_batch_create(const vnreg_model* model, const vnreg_options* options,
                              vnreg_batch** batch, vnreg_error* error) {
  return guarded(error, [&] {
    required(batch, "batch") = nullptr;
    *batch = new vnreg_batch{
        vnreg::BatchRegistrar(vnreg::model_or_builtin(model), vnreg::options_or_default(options)),
        {},
        {}};
  });
}
vnreg_code vnreg_batch_align(vnreg_batch* batch, const vnreg_cloud* sources,
                             const vnreg_cloud* targets, size_t count, vnreg_result* results,
                             vnreg_error* error) {
  return guarded(error, [&] {
    vnreg_batch& b = required(batch, "batch");
    if (count == 0) return;
    required(sources, "sources");
    required(targets, "targets");
    required(results, "results");
    b.pairs.clear();
    for (size_t i = 0; i < count; ++i) {
      b.pairs.push_back({vnreg::cloud_of(sources[i]), vnreg::cloud_of(targets[i])});
    }
    b.results.resize(count);
    b.batch.align_many(b.pairs, b.results);
    for (size_t i = 0; i < count; ++i) vnreg::copy_result(b.results[i], results[i]);
  });
}
void vnreg_batch_free(vnreg_batch* batch) { delete batch; }

vnreg_status vnreg_prepared_status(const vnreg_prepared* prepared) {
  return static_cast<vnreg_status>(prepared->cloud.status());
}
size_t vnreg_prepared_size(const vnreg_prepared* prepared) { return prepared->cloud.size(); }
void vnreg_prepared_free(vnreg_prepared* prepared) { delete prepared; }

vnreg_cancellation* vnreg_cancellation_create() { return new (std::nothrow) vnreg_cancellation; }
void vnreg_cancellation_request(vnreg_cancellation* cancellation) { cancellation->flag.request(); }
void vnreg_cancellation_reset(vnreg_cancellation* cancellation) { cancellation->flag.reset(); }
void vnreg_cancellation_free(vnreg_cancellation* cancellation) { delete cancellation; }
