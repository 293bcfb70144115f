// A model file of architecture `paper` with random weights, in memory; tests may damage it first.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "model_format/crc32c.hpp"
#include "model_format/model_file.hpp"
#include "vnreg/vnreg.hpp"

namespace vnreg::test {

struct Widths {
  std::uint64_t global = 16;
  std::uint64_t local = 16;
  std::uint64_t descriptor = 16;
  std::uint64_t pair = 8;
  std::uint64_t significance[2] = {12, 8};
  std::uint64_t neighbours = 12;
  bool shared_direction = false;
  bool shared_encoder = true;
  bool invariant_layer = true;
  std::uint64_t fine_iterations = 3;
  std::uint64_t keep_divisor = 6;
  double rms_radius = 0.5;
  std::uint64_t points = 1024;
};

struct StoredTensor {
  std::vector<std::uint64_t> shape;
  std::vector<float> values;
};

/// Everything that the file will hold, by name.
struct ModelDraft {
  std::map<std::string, model_format::Value> metadata;
  std::map<std::string, StoredTensor> tensors;

  std::vector<std::byte> bytes() const;
  Model build() const { return Model::from_bytes(bytes()); }
};

namespace detail {

class TensorMaker {
 public:
  TensorMaker(ModelDraft& draft, bool shared, std::uint64_t seed)
      : draft_(draft), shared_(shared), random_(seed) {}

  /// Random numbers of standard deviation `deviation`.
  void add(const std::string& name, std::vector<std::uint64_t> shape, float deviation,
           float mean = 0) {
    StoredTensor t;
    std::uint64_t count = 1;
    for (const std::uint64_t extent : shape) count *= extent;
    t.shape = std::move(shape);
    t.values.resize(count);
    std::normal_distribution<float> normal(mean, deviation);
    for (float& v : t.values) v = normal(random_);
    draft_.tensors[name] = std::move(t);
  }
  void matrix(const std::string& name, std::uint64_t out, std::uint64_t in) {
    add(name, {out, in}, 1.0f / std::sqrt(static_cast<float>(in)));
  }
  void direction(const std::string& name, std::uint64_t out, std::uint64_t in) {
    matrix(name, shared_ ? 1 : out, in);
  }
  void linear(const std::string& name, std::uint64_t out, std::uint64_t in) {
    matrix(name + ".weight", out, in);
    add(name + ".bias", {out}, 0.3f);
  }
  void block(const std::string& name, std::uint64_t in, std::uint64_t out) {
    const std::uint64_t hidden = std::min(in, out);
    direction(name + ".relu0", in, in);
    matrix(name + ".fc0", hidden, in);
    direction(name + ".relu1", hidden, hidden);
    matrix(name + ".fc1", out, hidden);
    if (in != out) matrix(name + ".shortcut", out, in);
  }
  void encoder(const std::string& name, std::uint64_t channels) {
    matrix(name + ".pre", 2 * channels, 3);
    for (const char* part :
         {".network0.0", ".network0.1", ".network0.2", ".network1.0", ".network1.1"}) {
      block(name + part, 2 * channels, channels);
    }
    direction(name + ".global.relu", channels, channels);
    matrix(name + ".global.fc", channels, channels);
  }
  void invariant_layer(std::uint64_t channels) {
    for (int i = 0; i < 2; ++i) {
      const std::string name = "local.invariant." + std::to_string(i);
      const std::uint64_t in = i == 0 ? channels : channels / 2;
      matrix(name + ".fc", in / 2, in);
      direction(name + ".direction", in / 2, in);
      add(name + ".scale", {in / 2}, 0.2f, 1.0f);
      add(name + ".shift", {in / 2}, 0.1f);
    }
    matrix("local.invariant.2.fc", 3, channels / 4);
  }

 private:
  ModelDraft& draft_;
  bool shared_;
  std::mt19937_64 random_;
};

inline void put(std::string& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out += static_cast<char>((value >> (8 * i)) & 0xff);
}

inline void put_counted(std::string& out, std::string_view text) {
  put(out, text.size(), 4);
  out += text;
}

inline void pad(std::string& out) { out.resize((out.size() + 63) / 64 * 64, '\0'); }

inline std::string metadata_bytes(const ModelDraft& draft) {
  std::string out;
  for (const auto& [key, value] : draft.metadata) {
    put_counted(out, key);
    put(out, value.index() + 1, 4);
    if (const auto* u = std::get_if<std::uint64_t>(&value)) put(out, *u, 8);
    if (const auto* d = std::get_if<double>(&value)) put(out, std::bit_cast<std::uint64_t>(*d), 8);
    if (const auto* b = std::get_if<bool>(&value)) put(out, *b ? 1 : 0, 1);
    if (const auto* s = std::get_if<std::string>(&value)) put_counted(out, *s);
  }
  return out;
}

}  // namespace detail

/// Random weights that keep the scale of features from layer to layer.
inline ModelDraft random_model(const Widths& w = {}, std::uint64_t seed = 1) {
  ModelDraft draft;
  draft.metadata = {
      {"arch", std::string("paper")},
      {"name", std::string("random")},
      {"channels.global", w.global},
      {"channels.local", w.local},
      {"channels.descriptor", w.descriptor},
      {"channels.pair", w.pair},
      {"channels.significance.0", w.significance[0]},
      {"channels.significance.1", w.significance[1]},
      {"neighbours", w.neighbours},
      {"relu.shared_direction", w.shared_direction},
      {"fine.iterations", w.fine_iterations},
      {"fine.keep_divisor", w.keep_divisor},
      {"input.rms_radius", w.rms_radius},
      {"input.points", w.points},
  };
  detail::TensorMaker make(draft, w.shared_direction, seed);
  const std::uint64_t c = w.global, l = w.local, d = w.descriptor, p = w.pair;
  make.encoder("encoder", c);
  if (!w.shared_encoder) {
    draft.metadata["ablation.shared_encoder"] = false;
    make.encoder("local.encoder", c);
  }
  make.block("local.network2.0", 2 * c, l);
  make.block("local.network2.1", 2 * l, l);
  if (w.invariant_layer) {
    make.invariant_layer(l);
  } else {
    draft.metadata["ablation.invariant_layer"] = false;
  }
  make.linear("local.descriptor", d, 3 * l);
  make.linear("fine.significance.0", w.significance[0], d);
  make.linear("fine.significance.1", w.significance[1], w.significance[0]);
  make.linear("fine.significance.2", 1, w.significance[1]);
  make.linear("fine.pair.0", p, 2 * d + 4);
  make.linear("fine.pair.1", p, p);
  for (const char* mlp : {"fine.similarity", "fine.weight"}) {
    make.linear(std::string(mlp) + ".0", p, p);
    make.linear(std::string(mlp) + ".1", 1, p);
  }
  return draft;
}

/// The bytes of model_format/SPEC.md.
inline std::vector<std::byte> ModelDraft::bytes() const {
  using detail::pad;
  using detail::put;
  const std::string metadata_part = detail::metadata_bytes(*this);
  std::string table, data;
  for (const auto& [name, tensor] : tensors) {
    detail::put_counted(table, name);
    put(table, 1, 4);
    put(table, tensor.shape.size(), 4);
    for (const std::uint64_t extent : tensor.shape) put(table, extent, 8);
    put(table, data.size(), 8);
    data.append(reinterpret_cast<const char*>(tensor.values.data()),
                tensor.values.size() * sizeof(float));
    pad(data);
  }
  std::string head = metadata_part + table;
  pad(head);  // the header is 64 bytes, so padding from its end is padding from the file's start
  const auto crc = [](std::string_view text, std::uint32_t previous = 0) {
    return model_format::crc32c(std::as_bytes(std::span(text)), previous);
  };
  std::string file("\x89VNR\r\n\x1a\n", 8);
  put(file, 1, 4);
  put(file, 0, 4);
  put(file, 64 + head.size() + data.size(), 8);
  put(file, metadata_part.size(), 8);
  put(file, tensors.size(), 8);
  put(file, 64 + head.size(), 8);
  put(file, data.size(), 8);
  put(file, crc(data), 4);
  put(file, crc(head, crc(file)), 4);
  file += head + data;
  const auto span = std::as_bytes(std::span(file));
  return {span.begin(), span.end()};
}

}  // namespace vnreg::test
