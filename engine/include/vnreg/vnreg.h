/** @file
 * vnreg for C99, and for every language that calls C: the rigid pose between two point clouds of
 * one object, from any starting pose.
 *
 * @code{.c}
 * vnreg_result result;
 * vnreg_error error;
 * if (vnreg_align(vnreg_cloud_f32(source, n), vnreg_cloud_f32(target, m), NULL, &result, &error))
 *   complain(error.message);
 * else if (result.has_pose)
 *   use(result.T_target_source);          // row-major 4 x 4: target = T * source
 * @endcode
 *
 * Functions that can fail return a vnreg_code, VNREG_OK = 0, and describe the failure in *error,
 * which may be NULL. Where the points are to blame, the call succeeds and result.status tells.
 * Nothing prints, exits, or keeps a pointer to points after it returns.
 *
 * Handles are made by functions that end in _load, _from_bytes, _builtin, _create or _prepare, and
 * given back by those that end in _free, which take NULL, too, in any order: what needs another
 * handle's content shares it. Cancellations alone must outlive the registrars that look at them.
 *
 * Threads: models and prepared clouds may be shared. A registrar or a batch serves one call at a
 * time. A cancellation may be raised from any thread and from a signal handler.
 *
 * The layout of the structures is fixed within a SOVERSION of the library; before version 1.0 that
 * is major.minor. Meanings, units and ranges are those of vnreg.hpp. */
#ifndef VNREG_VNREG_H
#define VNREG_VNREG_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Of the API: exported by the shared library. */
#define VNREG_C_API __attribute__((visibility("default")))

/** What a function returns that can fail: one of the codes below. */
typedef int32_t vnreg_code;
/** The codes; the first nine failures are those of vnreg::ErrorCode. */
enum {
  VNREG_OK = 0,                  /**< it did what it should */
  VNREG_FILE_UNREADABLE = 1,     /**< the file cannot be opened or read */
  VNREG_NOT_A_MODEL = 2,         /**< the magic bytes are wrong */
  VNREG_UNSUPPORTED_VERSION = 3, /**< written by a newer major version */
  VNREG_CORRUPT_MODEL = 4,       /**< a field, checksum, offset or size of the file is wrong */
  VNREG_WRONG_ARCHITECTURE = 5,  /**< not an architecture that this build can run */
  VNREG_MISSING_TENSOR = 6,      /**< a name or shape of the architecture is absent or different */
  VNREG_INVALID_OPTION = 7,      /**< a field of vnreg_options is out of its range */
  VNREG_UNSUPPORTED_CPU = 8,     /**< the build needs instructions that the processor lacks */
  VNREG_INVALID_POINTS = 9,      /**< scalar is neither VNREG_FLOAT32 nor VNREG_FLOAT64 */
  VNREG_NULL_ARGUMENT = 10,      /**< a pointer is NULL that must not be; `field` names it */
  VNREG_OUT_OF_MEMORY = 11,      /**< there is not enough memory */
  VNREG_UNEXPECTED = 12          /**< none of these; the message tells */
};

/** What is wrong, where, and both values; cut off where it does not fit. */
typedef struct vnreg_error {
  vnreg_code code;    /**< the kind of the failure */
  char field[256];    /**< what is wrong: a file, a field of a file, an option, an argument */
  char expected[256]; /**< what it should be */
  char got[256];      /**< what it is */
  char message[800];  /**< "field: expected ..., got ..." */
} vnreg_error;

/** How a pose is looked for: one of the modes below. */
typedef int32_t vnreg_mode;
/** The modes, as vnreg::Mode. */
enum {
  VNREG_MODE_COARSE = 0,  /**< the global register alone */
  VNREG_MODE_PAPER = 1,   /**< coarse, then the fine register */
  VNREG_MODE_VERIFIED = 2 /**< these poses and many others, judged and refined; the default */
};

/** What became of a call: one of the states below. */
typedef int32_t vnreg_status;
/** The states, as vnreg::Status. */
enum {
  VNREG_STATUS_OK = 0,             /**< a pose was found */
  VNREG_STATUS_LOW_CONFIDENCE = 1, /**< a pose was found, but it is more likely wrong than right */
  VNREG_STATUS_TOO_FEW_POINTS = 2, /**< a cloud has fewer points than the network needs */
  VNREG_STATUS_NOT_FINITE = 3,     /**< a coordinate is NaN, infinite or beyond 1e300 */
  VNREG_STATUS_DEGENERATE = 4,     /**< the points do not determine a rotation */
  VNREG_STATUS_AMBIGUOUS = 5,      /**< a pose was found, but another fits nearly as well */
  VNREG_STATUS_TIMED_OUT = 6,      /**< the budget was spent; has_pose tells if there is a pose */
  VNREG_STATUS_CANCELLED = 7,      /**< the cancellation was raised */
  VNREG_STATUS_SCALES_DIFFER = 8   /**< a pose was found, but one cloud is over 3 times as large */
};

/** The type of coordinates: one of those below. */
typedef int32_t vnreg_scalar;
/** The types of coordinates. */
enum {
  VNREG_FLOAT32 = 0, /**< float */
  VNREG_FLOAT64 = 1  /**< double */
};

/** Weights, immutable. */
typedef struct vnreg_model vnreg_model;
/** Aligns pairs, one at a time; owns its working memory. */
typedef struct vnreg_registrar vnreg_registrar;
/** Aligns many pairs, one per thread at a time. */
typedef struct vnreg_batch vnreg_batch;
/** A cloud with all that can be computed of it alone, immutable. */
typedef struct vnreg_prepared vnreg_prepared;
/** A flag that ends running calls when it is raised. */
typedef struct vnreg_cancellation vnreg_cancellation;

/** A borrowed cloud: `count` points, each three floats or doubles that need not be aligned, or what
 * was prepared before. */
typedef struct vnreg_cloud {
  const void* data;               /**< the first point's x */
  size_t count;                   /**< how many points */
  size_t stride_bytes;            /**< from point to point; 0: the coordinates are packed */
  size_t axis_stride_bytes;       /**< from x to y and from y to z; 0: they follow each other */
  vnreg_scalar scalar;            /**< VNREG_FLOAT32 or VNREG_FLOAT64 */
  const vnreg_prepared* prepared; /**< if not NULL, the other fields do not matter */
} vnreg_cloud;

/** Packed floats: x y z x y z. */
VNREG_C_API vnreg_cloud vnreg_cloud_f32(const float* xyz, size_t count);
/** Packed doubles: x y z x y z. */
VNREG_C_API vnreg_cloud vnreg_cloud_f64(const double* xyz, size_t count);
/** What vnreg_registrar_prepare() has made. */
VNREG_C_API vnreg_cloud vnreg_cloud_prepared(const vnreg_prepared* prepared);

/** What a registrar is made with, checked there. Begin with VNREG_DEFAULT_OPTIONS. */
typedef struct vnreg_options {
  vnreg_mode mode;       /**< how poses are looked for; VNREG_MODE_PAPER needs a model for it */
  int32_t threads;       /**< of one call; in a batch, pairs at a time; 0: what OpenMP says */
  int32_t max_points;    /**< 0: what the model was trained with; else 64 to 16,384 */
  int32_t record_stages; /**< not 0: keep activations for vnreg_registrar_stage() */
  uint64_t seed;         /**< of the subsampling of larger clouds */
  double time_budget_ms; /**< of one pair; 0: no limit; at most 1e9 */
  const vnreg_cancellation* cancellation; /**< ends running calls when it is raised; may be NULL */
  int32_t drop_non_finite; /**< not 0: points that are no numbers are left out, else refused */
} vnreg_options;

/** vnreg_options options = VNREG_DEFAULT_OPTIONS; where options are asked for, NULL means these. */
#define VNREG_DEFAULT_OPTIONS \
  { VNREG_MODE_VERIFIED, 0, 0, 0, 0, 0.0, NULL, 0 }

/** The most alternatives that a result has. */
#define VNREG_MOST_ALTERNATIVES 4

/** A pose that fits the clouds, and how well: vnreg::Alternative. */
typedef struct vnreg_alternative {
  double T_target_source[16]; /**< row-major 4 x 4 */
  double score;               /**< what poses are ranked by */
} vnreg_alternative;

/** What the confidence of mode verified is computed from: vnreg::Evidence. */
typedef struct vnreg_evidence {
  double score;        /**< of the pose */
  double margin;       /**< 1 - odds of the second best pose / odds */
  double covered;      /**< share of points that have a match in the other cloud */
  double contradicted; /**< share without, where the other cloud should show something */
  double beyond;       /**< share without, outside of what the other cloud shows */
  double residual;     /**< r.m.s. distance of matches from each other's planes */
  double noise;        /**< r.m.s. distance of points from the planes of their own cloud */
  double certainty;    /**< how well the shape holds the rotation */
} vnreg_evidence;

/** How long the parts of a call took, in milliseconds: vnreg::StageTimes. */
typedef struct vnreg_times {
  double prepare;    /**< check, subsample, normalise, neighbourhoods */
  double encode;     /**< the network on both clouds */
  double coarse;     /**< global register */
  double fine;       /**< fine register */
  double hypotheses; /**< mode verified: poses proposed */
  double verify;     /**< mode verified: poses compared and refined */
  double measure;    /**< residual and overlap */
  double total;      /**< the whole call */
} vnreg_times;

/** The answer of a call: vnreg::Result. */
typedef struct vnreg_result {
  vnreg_status status;               /**< whether there is a pose, and how good, or why not */
  int32_t has_pose;                  /**< 0: the poses are the identity */
  double T_target_source[16];        /**< row-major 4 x 4: target = T * source */
  double T_target_source_coarse[16]; /**< the coarse register's answer alone */
  double covariance[36];    /**< row-major 6 x 6; rotation vector, then translation; or NaN */
  double confidence;        /**< probability that the pose is right; NaN where unknown */
  double overlap;           /**< share of points within inlier_distance of the other cloud */
  double rmse;              /**< r.m.s. distance of those, in the units of the input */
  double inlier_distance;   /**< in the units of the input */
  double score;             /**< mode verified: of the pose; else NaN */
  size_t alternative_count; /**< how many of the following are set */
  vnreg_alternative alternatives[VNREG_MOST_ALTERNATIVES]; /**< other poses, the best first */
  vnreg_evidence evidence; /**< what the confidence is computed from */
  size_t points_source;    /**< points used, after subsampling */
  size_t points_target;    /**< points used, after subsampling */
  size_t dropped_source;   /**< points left out by drop_non_finite */
  size_t dropped_target;   /**< points left out by drop_non_finite */
  vnreg_times ms;          /**< how long it took */
} vnreg_result;

/** For example "0.1.0". This and the other words live as long as the library. */
VNREG_C_API const char* vnreg_version(void);
/** What the build was compiled for, for example "x86-64-v3". */
VNREG_C_API const char* vnreg_instruction_set(void);
/** For example "verified"; "unknown" for what is no mode. */
VNREG_C_API const char* vnreg_mode_name(vnreg_mode mode);
/** For example "ok"; "unknown" for what is no status. */
VNREG_C_API const char* vnreg_status_name(vnreg_status status);
/** For example "invalid_option"; "unknown" for what is no code. */
VNREG_C_API const char* vnreg_code_name(vnreg_code code);

/** Reads a .vnr file. */
VNREG_C_API vnreg_code vnreg_model_load(const char* path, vnreg_model** model, vnreg_error* error);
/** Reads a model from memory; `bytes` may be released afterwards. */
VNREG_C_API vnreg_code vnreg_model_from_bytes(const void* bytes, size_t size, vnreg_model** model,
                                              vnreg_error* error);
/** The weights compiled into the library. */
VNREG_C_API vnreg_code vnreg_model_builtin(vnreg_model** model, vnreg_error* error);
/** What the file says it is called; lives as long as the handle. */
VNREG_C_API const char* vnreg_model_name(const vnreg_model* model);
/** Points per cloud that the model was trained with. */
VNREG_C_API int32_t vnreg_model_points(const vnreg_model* model);
/** The fewest points a cloud must have. */
VNREG_C_API int32_t vnreg_model_min_points(const vnreg_model* model);
/** Gives the handle back. */
VNREG_C_API void vnreg_model_free(vnreg_model* model);

/** One call with the built-in model. */
VNREG_C_API vnreg_code vnreg_align(vnreg_cloud source, vnreg_cloud target,
                                   const vnreg_options* options, vnreg_result* result,
                                   vnreg_error* error);

/** Makes all working memory, so that aligning allocates nothing. A model of NULL is the built-in
 * one; options of NULL are the default ones. */
VNREG_C_API vnreg_code vnreg_registrar_create(const vnreg_model* model,
                                              const vnreg_options* options,
                                              vnreg_registrar** registrar, vnreg_error* error);
/** The pose that maps `source` onto `target`. */
VNREG_C_API vnreg_code vnreg_registrar_align(vnreg_registrar* registrar, vnreg_cloud source,
                                             vnreg_cloud target, vnreg_result* result,
                                             vnreg_error* error);
/** Does once what aligning would do for this cloud each time; look at vnreg_prepared_status(). */
VNREG_C_API vnreg_code vnreg_registrar_prepare(vnreg_registrar* registrar, vnreg_cloud cloud,
                                               vnreg_prepared** prepared, vnreg_error* error);
/** Gives the handle back. */
VNREG_C_API void vnreg_registrar_free(vnreg_registrar* registrar);

/** One recorded activation, row-major; valid until the registrar's next call. */
typedef struct vnreg_stage {
  const char* name;     /**< for example "source.descriptor" */
  const size_t* shape;  /**< `rank` numbers */
  size_t rank;          /**< how many axes */
  const double* values; /**< `count` numbers */
  size_t count;         /**< the product of the shape */
} vnreg_stage;

/** How many activations the last call recorded; 0 unless record_stages is set. */
VNREG_C_API size_t vnreg_registrar_stage_count(const vnreg_registrar* registrar);
/** The activation `index`, in the order of computation; all zero when there is none. */
VNREG_C_API vnreg_stage vnreg_registrar_stage(const vnreg_registrar* registrar, size_t index);

/** Makes working memory for `options->threads` pairs at a time. A model of NULL is the built-in
 * one; options of NULL are the default ones. */
VNREG_C_API vnreg_code vnreg_batch_create(const vnreg_model* model, const vnreg_options* options,
                                          vnreg_batch** batch, vnreg_error* error);
/** Aligns `count` pairs: results[i] is that of sources[i] and targets[i]. */
VNREG_C_API vnreg_code vnreg_batch_align(vnreg_batch* batch, const vnreg_cloud* sources,
                                         const vnreg_cloud* targets, size_t count,
                                         vnreg_result* results, vnreg_error* error);
/** Gives the handle back. */
VNREG_C_API void vnreg_batch_free(vnreg_batch* batch);

/** VNREG_STATUS_OK, or why no registrar finds a pose with it. */
VNREG_C_API vnreg_status vnreg_prepared_status(const vnreg_prepared* prepared);
/** Points used, after subsampling. */
VNREG_C_API size_t vnreg_prepared_size(const vnreg_prepared* prepared);
/** Gives the handle back. */
VNREG_C_API void vnreg_prepared_free(vnreg_prepared* prepared);

/** A flag that is not raised; NULL when there is no memory. */
VNREG_C_API vnreg_cancellation* vnreg_cancellation_create(void);
/** Raises it: calls that look at it end within about a millisecond. Async-signal-safe. */
VNREG_C_API void vnreg_cancellation_request(vnreg_cancellation* cancellation);
/** Lets calls run again. */
VNREG_C_API void vnreg_cancellation_reset(vnreg_cancellation* cancellation);
/** Gives the handle back; no registrar may look at it any more. */
VNREG_C_API void vnreg_cancellation_free(vnreg_cancellation* cancellation);

#ifdef __cplusplus
}
#endif

#endif
