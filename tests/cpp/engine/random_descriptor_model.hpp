// A model file of architecture `vnreg` with random weights, in memory.
#pragma once

#include "random_model.hpp"

namespace vnreg::test {

struct DescriptorWidths {
  std::uint64_t vectors = 12;
  std::uint64_t scalars = 20;
  std::uint64_t gates = 3;
  std::uint64_t products = 3;
  std::uint64_t local = 10;
  std::uint64_t context = 17;
  std::uint64_t frames = 5;
  std::uint64_t global = 6;
  std::uint64_t local_blocks = 1;
  std::uint64_t context_blocks = 2;
  std::uint64_t encoded = 512;
};

namespace detail {

inline void add_lean_block(TensorMaker& make, const std::string& name, std::uint64_t channels,
                           bool pooled) {
  make.matrix(name + ".direction", channels, channels);
  make.matrix(name + ".linear", channels, channels);
  if (pooled) make.matrix(name + ".pool", channels, channels);
}

inline void add_stage_end(TensorMaker& make, const std::string& stage, const DescriptorWidths& w,
                          std::uint64_t descriptor, std::uint64_t products, std::uint64_t others) {
  make.linear(stage + ".mlp.0", w.scalars, products * w.vectors + others * w.scalars);
  make.linear(stage + ".mlp.1", w.scalars, w.scalars);
  make.linear(stage + ".descriptor", descriptor, w.scalars);
  make.matrix(stage + ".frames", w.frames, w.vectors);
}

}  // namespace detail

inline ModelDraft random_descriptor_model(const DescriptorWidths& w = {}, std::uint64_t seed = 1) {
  ModelDraft draft;
  draft.metadata = {
      {"arch", std::string("vnreg")},
      {"name", std::string("random")},
      {"channels.vector", w.vectors},
      {"channels.scalar", w.scalars},
      {"channels.gate", w.gates},
      {"channels.product", w.products},
      {"channels.local_descriptor", w.local},
      {"channels.context_descriptor", w.context},
      {"channels.frame", w.frames},
      {"channels.global", w.global},
      {"blocks.local", w.local_blocks},
      {"blocks.context", w.context_blocks},
      {"moments.radius.0", 0.25},
      {"moments.radius.1", 0.5},
      {"moments.radius.2", 1.0},
      {"neighbourhood.local", 0.5},
      {"neighbourhood.context", 0.8},
      {"input.rms_radius", 1.0},
      {"input.points", std::uint64_t{1024}},
      {"input.encoded", w.encoded},
  };
  detail::TensorMaker make(draft, false, seed);
  const std::uint64_t c = w.vectors, h = w.scalars;
  make.linear("point.scalars", h, 18);
  make.matrix("point.vectors", c, 21);
  make.linear("point.gate", c, h);
  detail::add_lean_block(make, "point.block", c, false);
  make.matrix("point.products", w.products, c);
  make.linear("point.mlp", h, w.products * c + h);
  for (const std::string stage : {"local", "context"}) {
    make.linear(stage + ".gate", w.gates, h);
    make.matrix(stage + ".collect", c, w.gates + c);
    make.matrix(stage + ".products", w.products, c);
  }
  for (std::uint64_t i = 0; i < w.local_blocks; ++i) {
    detail::add_lean_block(make, "local.block." + std::to_string(i), c, false);
  }
  for (std::uint64_t i = 0; i < w.context_blocks; ++i) {
    detail::add_lean_block(make, "context.block." + std::to_string(i), c, true);
  }
  make.matrix("context.vectors", c, 8);
  make.matrix("context.products_pooled", w.products, c);
  detail::add_stage_end(make, "local", w, w.local, w.products, 2);
  detail::add_stage_end(make, "context", w, w.context, 2 * w.products, 3);
  make.linear("context.logits", 3, h);
  make.matrix("context.global", w.global, c);
  make.add("lengths", {2}, 0.1f, 3.0f);
  return draft;
}

}  // namespace vnreg::test
