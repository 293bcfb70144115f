/* From C: a cloud and its turned copy, and every error checked. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <vnreg/vnreg.h>

enum { count = 800 };

static void check(vnreg_code code, const vnreg_error* error) {
  if (code == VNREG_OK) return;
  fprintf(stderr, "%s: %s\n", vnreg_code_name(code), error->message);
  exit(1);
}

/* A spiral shell, and the same turned by 90 degrees about x and moved. */
static void make_clouds(double source[count][3], double target[count][3]) {
  int i;
  for (i = 0; i < count; ++i) {
    const double t = 0.04 * i, r = 0.1 + 0.001 * i;
    source[i][0] = r * cos(t);
    source[i][1] = 0.7 * r * sin(t);
    source[i][2] = 0.5 * r * r * (1 + 0.3 * sin(3 * t));
    target[i][0] = source[i][0] + 2;
    target[i][1] = -source[i][2];
    target[i][2] = source[i][1] - 1;
  }
}

int main(void) {
  static double source[count][3], target[count][3];
  vnreg_options options = VNREG_DEFAULT_OPTIONS;
  vnreg_registrar* registrar;
  vnreg_result result;
  vnreg_error error;
  int row;

  make_clouds(source, target);
  options.threads = 1;
  options.time_budget_ms = 1000;
  check(vnreg_registrar_create(NULL, &options, &registrar, &error), &error);
  check(vnreg_registrar_align(registrar, vnreg_cloud_f64(source[0], count),
                              vnreg_cloud_f64(target[0], count), &result, &error),
        &error);
  printf("vnreg %s: %s\n", vnreg_version(), vnreg_status_name(result.status));
  for (row = 0; row < 4; ++row) {
    const double* T = result.T_target_source + 4 * row;
    printf("%8.4f %8.4f %8.4f %8.4f\n", T[0], T[1], T[2], T[3]);
  }
  vnreg_registrar_free(registrar);
  return result.has_pose ? 0 : 1;
}
