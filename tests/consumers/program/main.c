/* The same in C99. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <vnreg/vnreg.h>

enum { count = 600 };

static void make_clouds(float source[count][3], double target[count][4]) {
  int i;
  for (i = 0; i < count; ++i) {
    const double t = 0.05 * i, r = 0.2 + 0.001 * i;
    source[i][0] = (float)(r * cos(t));
    source[i][1] = (float)(0.6 * r * sin(t));
    source[i][2] = (float)(0.002 * i * r);
    target[i][0] = 3 - source[i][1];
    target[i][1] = source[i][0];
    target[i][2] = source[i][2] + 1;
    target[i][3] = 0;
  }
}

static int is_right(const vnreg_result* result) {
  const double* T = result->T_target_source;
  return result->has_pose && fabs(T[4] - 1) < 0.01 && fabs(T[3] - 3) < 0.02;
}

int main(void) {
  static float source[count][3];
  static double target[count][4];
  vnreg_options options = VNREG_DEFAULT_OPTIONS;
  vnreg_model* model = NULL;
  vnreg_registrar* registrar = NULL;
  vnreg_prepared* prepared = NULL;
  vnreg_cloud padded = vnreg_cloud_f64(&target[0][0], count);
  vnreg_result result;
  vnreg_error error;

  make_clouds(source, target);
  padded.stride_bytes = sizeof target[0];
  options.threads = 1;
  if (vnreg_model_builtin(&model, &error) ||
      vnreg_registrar_create(model, &options, &registrar, &error) ||
      vnreg_registrar_prepare(registrar, padded, &prepared, &error) ||
      vnreg_registrar_align(registrar, vnreg_cloud_f32(&source[0][0], count),
                            vnreg_cloud_prepared(prepared), &result, &error)) {
    fprintf(stderr, "%s\n", error.message);
    return 1;
  }
  printf("%s %s: %s\n", vnreg_version(), vnreg_instruction_set(), vnreg_status_name(result.status));
  vnreg_prepared_free(prepared);
  vnreg_registrar_free(registrar);
  vnreg_model_free(model);
  if (vnreg_model_load("/nowhere.vnr", &model, &error) != VNREG_FILE_UNREADABLE) return 2;
  if (strstr(error.message, "/nowhere.vnr") == NULL || model != NULL) return 3;
  return is_right(&result) ? 0 : 4;
}
