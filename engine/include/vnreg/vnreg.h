/* vnreg for C99, and for every language that calls C: the rigid pose between two point clouds of
   one object, from any starting pose.

     vnreg_result result;
     vnreg_error error;
     if (vnreg_align(vnreg_cloud_f32(source, n), vnreg_cloud_f32(target, m), NULL, &result, &error))
       complain(error.message);
     else if (result.has_pose)
       use(result.T_target_source);          row-major 4 x 4: target = T * source

   Functions that can fail return a vnreg_code, VNREG_OK = 0, and describe the failure in *error,
   which may be NULL. Where the points are to blame, the call succeeds and result.status tells.
   Nothing prints, exits, or keeps a pointer to points after it returns.

   Handles are made by *_load, *_create, *_prepare and given back by *_free, which takes NULL, too,
   in any order: what needs another handle's content shares it. Cancellations alone must outlive the
   registrars that look at them.

   Threads: models and prepared clouds may be shared. A registrar or a batch serves one call at a
   time. A cancellation may be raised from any thread and from a signal handler.

   The layout of the structures is fixed within a SOVERSION of the library; before version 1.0 that
   is major.minor. Meanings, units and ranges are those of vnreg.hpp. */
#ifndef VNREG_VNREG_H
#define VNREG_VNREG_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define VNREG_C_API __attribute__((visibility("default")))

typedef int32_t vnreg_code;
enum {
  VNREG_OK = 0,
  VNREG_FILE_UNREADABLE = 1,
  VNREG_NOT_A_MODEL = 2,
  VNREG_UNSUPPORTED_VERSION = 3,
  VNREG_CORRUPT_MODEL = 4,
  VNREG_WRONG_ARCHITECTURE = 5,
  VNREG_MISSING_TENSOR = 6,
  VNREG_INVALID_OPTION = 7,
  VNREG_UNSUPPORTED_CPU = 8,
  VNREG_INVALID_POINTS = 9, /* scalar is neither VNREG_FLOAT32 nor VNREG_FLOAT64 */
  VNREG_NULL_ARGUMENT = 10,
  VNREG_OUT_OF_MEMORY = 11,
  VNREG_UNEXPECTED = 12
};

/* What is wrong, where, and both values; cut off where it does not fit. */
typedef struct vnreg_error {
  vnreg_code code;
  char field[256];
  char expected[256];
  char got[256];
  char message[800]; /* "field: expected ..., got ..." */
} vnreg_error;

typedef int32_t vnreg_mode;
enum { VNREG_MODE_COARSE = 0, VNREG_MODE_PAPER = 1, VNREG_MODE_VERIFIED = 2 };

typedef int32_t vnreg_status;
enum {
  VNREG_STATUS_OK = 0,
  VNREG_STATUS_LOW_CONFIDENCE = 1,
  VNREG_STATUS_TOO_FEW_POINTS = 2,
  VNREG_STATUS_NOT_FINITE = 3,
  VNREG_STATUS_DEGENERATE = 4,
  VNREG_STATUS_AMBIGUOUS = 5,
  VNREG_STATUS_TIMED_OUT = 6,
  VNREG_STATUS_CANCELLED = 7
};

typedef int32_t vnreg_scalar;
enum { VNREG_FLOAT32 = 0, VNREG_FLOAT64 = 1 };

typedef struct vnreg_model vnreg_model;
typedef struct vnreg_registrar vnreg_registrar;
typedef struct vnreg_batch vnreg_batch;
typedef struct vnreg_prepared vnreg_prepared;
typedef struct vnreg_cancellation vnreg_cancellation;

/* A borrowed cloud: `count` points, each three floats or doubles that need not be aligned, or what
   was prepared before. */
typedef struct vnreg_cloud {
  const void* data;
  size_t count;
  size_t stride_bytes;      /* from point to point; 0: the coordinates are packed */
  size_t axis_stride_bytes; /* from x to y and from y to z; 0: they follow each other */
  vnreg_scalar scalar;
  const vnreg_prepared* prepared; /* if not NULL, the other fields do not matter */
} vnreg_cloud;

VNREG_C_API vnreg_cloud vnreg_cloud_f32(const float* xyz, size_t count);
VNREG_C_API vnreg_cloud vnreg_cloud_f64(const double* xyz, size_t count);
VNREG_C_API vnreg_cloud vnreg_cloud_prepared(const vnreg_prepared* prepared);

typedef struct vnreg_options {
  vnreg_mode mode;
  int32_t threads;       /* 0: what OpenMP says */
  int32_t max_points;    /* 0: what the model was trained with; else 64 to 16,384 */
  int32_t record_stages; /* not 0: keep activations for vnreg_registrar_stage() */
  uint64_t seed;
  double time_budget_ms;                  /* 0: no limit */
  const vnreg_cancellation* cancellation; /* may be NULL */
} vnreg_options;

/* vnreg_options options = VNREG_DEFAULT_OPTIONS; where options are asked for, NULL means these. */
#define VNREG_DEFAULT_OPTIONS \
  { VNREG_MODE_VERIFIED, 0, 0, 0, 0, 0.0, NULL }

#define VNREG_MOST_ALTERNATIVES 4

typedef struct vnreg_alternative {
  double T_target_source[16];
  double score;
} vnreg_alternative;

/* What the confidence of mode verified is computed from. */
typedef struct vnreg_evidence {
  double score, margin, covered, contradicted, beyond, residual, noise, certainty;
} vnreg_evidence;

typedef struct vnreg_times { /* milliseconds */
  double prepare, encode, coarse, fine, hypotheses, verify, measure, total;
} vnreg_times;

typedef struct vnreg_result {
  vnreg_status status;
  int32_t has_pose; /* 0: the poses are the identity */
  double T_target_source[16];
  double T_target_source_coarse[16];
  double covariance[36]; /* of rotation vector, then translation; NaN where unknown */
  double confidence;     /* NaN where unknown */
  double overlap;
  double rmse;
  double inlier_distance;
  double score;
  size_t alternative_count;
  vnreg_alternative alternatives[VNREG_MOST_ALTERNATIVES];
  vnreg_evidence evidence;
  size_t points_source;
  size_t points_target;
  vnreg_times ms;
} vnreg_result;

/* Words that live as long as the library: "0.1.0", "x86-64-v3", "verified", "ok",
   "invalid_option". */
VNREG_C_API const char* vnreg_version(void);
VNREG_C_API const char* vnreg_instruction_set(void);
VNREG_C_API const char* vnreg_mode_name(vnreg_mode mode);
VNREG_C_API const char* vnreg_status_name(vnreg_status status);
VNREG_C_API const char* vnreg_code_name(vnreg_code code);

/* Weights, immutable. `path` is that of a .vnr file; `bytes` may be released afterwards. */
VNREG_C_API vnreg_code vnreg_model_load(const char* path, vnreg_model** model, vnreg_error* error);
VNREG_C_API vnreg_code vnreg_model_from_bytes(const void* bytes, size_t size, vnreg_model** model,
                                              vnreg_error* error);
VNREG_C_API vnreg_code vnreg_model_builtin(vnreg_model** model, vnreg_error* error);
VNREG_C_API const char* vnreg_model_name(const vnreg_model* model);
VNREG_C_API int32_t vnreg_model_points(const vnreg_model* model);
VNREG_C_API int32_t vnreg_model_min_points(const vnreg_model* model);
VNREG_C_API void vnreg_model_free(vnreg_model* model);

/* One call with the built-in model. */
VNREG_C_API vnreg_code vnreg_align(vnreg_cloud source, vnreg_cloud target,
                                   const vnreg_options* options, vnreg_result* result,
                                   vnreg_error* error);

/* Keeps its working memory between calls; aligning allocates nothing. A model of NULL is the
   built-in one. */
VNREG_C_API vnreg_code vnreg_registrar_create(const vnreg_model* model,
                                              const vnreg_options* options,
                                              vnreg_registrar** registrar, vnreg_error* error);
VNREG_C_API vnreg_code vnreg_registrar_align(vnreg_registrar* registrar, vnreg_cloud source,
                                             vnreg_cloud target, vnreg_result* result,
                                             vnreg_error* error);
VNREG_C_API vnreg_code vnreg_registrar_prepare(vnreg_registrar* registrar, vnreg_cloud cloud,
                                               vnreg_prepared** prepared, vnreg_error* error);
VNREG_C_API void vnreg_registrar_free(vnreg_registrar* registrar);

/* One recorded activation, row-major; valid until the registrar's next call. */
typedef struct vnreg_stage {
  const char* name;
  const size_t* shape;
  size_t rank;
  const double* values;
  size_t count;
} vnreg_stage;

VNREG_C_API size_t vnreg_registrar_stage_count(const vnreg_registrar* registrar);
/* All zero when there is no stage `index`. */
VNREG_C_API vnreg_stage vnreg_registrar_stage(const vnreg_registrar* registrar, size_t index);

/* Many pairs, one per thread at a time: results[i] is that of sources[i] and targets[i]. */
VNREG_C_API vnreg_code vnreg_batch_create(const vnreg_model* model, const vnreg_options* options,
                                          vnreg_batch** batch, vnreg_error* error);
VNREG_C_API vnreg_code vnreg_batch_align(vnreg_batch* batch, const vnreg_cloud* sources,
                                         const vnreg_cloud* targets, size_t count,
                                         vnreg_result* results, vnreg_error* error);
VNREG_C_API void vnreg_batch_free(vnreg_batch* batch);

/* A cloud with all that can be computed of it alone. */
VNREG_C_API vnreg_status vnreg_prepared_status(const vnreg_prepared* prepared);
VNREG_C_API size_t vnreg_prepared_size(const vnreg_prepared* prepared);
VNREG_C_API void vnreg_prepared_free(vnreg_prepared* prepared);

/* NULL when there is no memory. */
VNREG_C_API vnreg_cancellation* vnreg_cancellation_create(void);
VNREG_C_API void vnreg_cancellation_request(vnreg_cancellation* cancellation);
VNREG_C_API void vnreg_cancellation_reset(vnreg_cancellation* cancellation);
VNREG_C_API void vnreg_cancellation_free(vnreg_cancellation* cancellation);

#ifdef __cplusplus
}
#endif

#endif
