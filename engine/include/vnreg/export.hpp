/// @file
/// Marks what the shared library exports; everything else is hidden.
#pragma once

/// Of the API: exported by the shared library.
#define VNREG_API __attribute__((visibility("default")))
