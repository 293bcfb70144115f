#include "kernels/neighbours.hpp"

#include <numeric>

#include "helpers.hpp"
#include "kernels/reference/neighbours.hpp"

namespace vnreg::kernels::test {
namespace {

struct PointSet {
  std::vector<float> x, y, z;

  explicit PointSet(Index count) : x(static_cast<std::size_t>(count)), y(x.size()), z(x.size()) {}
  Index count() const { return static_cast<Index>(x.size()); }
  Coordinates coordinates() const { return {x.data(), y.data(), z.data()}; }
  void set(Index i, float px, float py, float pz) {
    const auto at = static_cast<std::size_t>(i);
    x[at] = px;
    y[at] = py;
    z[at] = pz;
  }
};

PointSet gaussian(Index count, Random& random, float scale = 1.0f) {
  PointSet points(count);
  for (Index i = 0; i < count; ++i) {
    points.set(i, scale * random.normal(), scale * random.normal(), scale * random.normal());
  }
  return points;
}

/// Integer coordinates: most distances are tied.
PointSet lattice(Index count, Random& random) {
  PointSet points(count);
  for (Index i = 0; i < count; ++i) {
    points.set(i, static_cast<float>(random.integer(0, 5)),
               static_cast<float>(random.integer(0, 5)), static_cast<float>(random.integer(0, 5)));
  }
  return points;
}

PointSet line(Index count, Random& random) {
  PointSet points(count);
  for (Index i = 0; i < count; ++i) {
    const float t = random.normal();
    points.set(i, t, 2 * t, -t);
  }
  return points;
}

PointSet all_equal(Index count) {
  PointSet points(count);
  for (Index i = 0; i < count; ++i) points.set(i, 0.25f, -1.5f, 3.0f);
  return points;
}

/// Two tight clusters a thousand of their sizes apart, and one point far from both.
PointSet clusters(Index count, Random& random) {
  PointSet points = gaussian(count, random, 1e-3f);
  for (Index i = 0; i < count; i += 2) points.x[static_cast<std::size_t>(i)] += 1.0f;
  points.set(count - 1, 500.0f, -300.0f, 0.0f);
  return points;
}

void check_neighbours(const PointSet& points, Index k) {
  const Index count = points.count();
  SpatialIndex index(count);
  index.build(points.coordinates(), count);
  NeighbourScratch scratch(count);
  GuardedFloats dx(count), dy(count), dz(count), spacing(count);
  // In two parts, as two threads would do it.
  const Index half = index.leaves() / 2;
  mean_neighbour_offsets(index, k, 0, half, scratch, dx.data(), dy.data(), dz.data(),
                         spacing.data());
  mean_neighbour_offsets(index, k, half, index.leaves(), scratch, dx.data(), dy.data(), dz.data(),
                         spacing.data());
  GuardedFloats alone(count);
  nearest_others(index, 0, half, scratch, alone.data());
  nearest_others(index, half, index.leaves(), scratch, alone.data());
  REQUIRE((dx.intact() && dy.intact() && dz.intact() && spacing.intact() && alone.intact()));
  float extent = 0;
  for (Index i = 0; i < count; ++i) {
    extent = std::max({extent, std::abs(points.x[static_cast<std::size_t>(i)]),
                       std::abs(points.y[static_cast<std::size_t>(i)])});
  }
  for (Index i = 0; i < count; ++i) {
    const std::vector<Index> order = reference::by_distance(points.coordinates(), count, i);
    double mean[3] = {0, 0, 0};
    for (Index n = 0; n < k; ++n) {
      const auto j = static_cast<std::size_t>(order[static_cast<std::size_t>(n)]);
      const auto at = static_cast<std::size_t>(i);
      mean[0] += static_cast<double>(points.x[j] - points.x[at]) / static_cast<double>(k);
      mean[1] += static_cast<double>(points.y[j] - points.y[at]) / static_cast<double>(k);
      mean[2] += static_cast<double>(points.z[j] - points.z[at]) / static_cast<double>(k);
    }
    CAPTURE(i);
    // The second part: the steps of float32 next to zero.
    const double tolerance = 1e-6 * static_cast<double>(extent) + 1e-44;
    REQUIRE(std::abs(static_cast<double>(dx.data()[i]) - mean[0]) <= tolerance);
    REQUIRE(std::abs(static_cast<double>(dy.data()[i]) - mean[1]) <= tolerance);
    REQUIRE(std::abs(static_cast<double>(dz.data()[i]) - mean[2]) <= tolerance);
    const float expected = reference::spacing_squared(points.coordinates(), count, i);
    REQUIRE(spacing.data()[i] == expected);
    REQUIRE(alone.data()[i] == expected);
  }
}

TEST_CASE("k nearest neighbours equal the full sort, ties by lower index") {
  Random random(61);
  for (const Index count : {1, 2, 3, 7, 15, 16, 17, 63, 64, 65, 333, 1024}) {
    for (const Index k : {1, 2, 5, 20, 64}) {
      if (k > count) continue;
      CAPTURE(count, k);
      SECTION("gaussian " + std::to_string(count) + "/" + std::to_string(k)) {
        check_neighbours(gaussian(count, random), k);
      }
      SECTION("lattice " + std::to_string(count) + "/" + std::to_string(k)) {
        check_neighbours(lattice(count, random), k);
      }
      SECTION("line " + std::to_string(count) + "/" + std::to_string(k)) {
        check_neighbours(line(count, random), k);
      }
      SECTION("all equal " + std::to_string(count) + "/" + std::to_string(k)) {
        check_neighbours(all_equal(count), k);
      }
      SECTION("clusters " + std::to_string(count) + "/" + std::to_string(k)) {
        check_neighbours(clusters(count, random), k);
      }
    }
  }
}

TEST_CASE("squares at the ends of float32's range do not lose neighbours") {
  Random random(62);
  for (const float scale : {1e15f, 1e-15f, 1e-19f, 1e-21f, 1e-23f, 1e-38f, 1e-45f}) {
    CAPTURE(scale);
    check_neighbours(gaussian(333, random, scale), 20);
  }
}

TEST_CASE("the order of the index is a permutation in leaves whose boxes hold") {
  Random random(63);
  for (const Index count : {1, 15, 16, 17, 333, 1024}) {
    const PointSet points = lattice(count, random);
    SpatialIndex index(count);
    index.build(points.coordinates(), count);
    std::vector<std::uint32_t> seen(index.original(), index.original() + count);
    std::sort(seen.begin(), seen.end());
    for (Index i = 0; i < count; ++i) REQUIRE(seen[static_cast<std::size_t>(i)] == i);
    std::vector<float> bounds(static_cast<std::size_t>(index.leaves()));
    for (Index q = 0; q < 20; ++q) {
      const float x = random.normal(), y = random.normal(), z = 5 * random.normal();
      index.leaf_bounds(x, y, z, bounds.data());
      for (Index leaf = 0; leaf < index.leaves(); ++leaf) {
        float squared[SpatialIndex::leaf_size];
        index.leaf_distances(leaf, x, y, z, squared);
        for (Index i = 0; i < SpatialIndex::leaf_size; ++i) {
          REQUIRE(bounds[static_cast<std::size_t>(leaf)] <= squared[i]);
          const bool padding = leaf * SpatialIndex::leaf_size + i >= count;
          REQUIRE(std::isinf(squared[i]) == padding);
        }
      }
    }
  }
}

TEST_CASE("lists of neighbours hold the k nearest, ties by lower index") {
  Random random(68);
  constexpr Index k = 14;
  for (const Index count : {14, 17, 65, 333, 1024}) {
    for (const PointSet& points : {gaussian(count, random), lattice(count, random),
                                   clusters(count, random), all_equal(count)}) {
      SpatialIndex index(count);
      index.build(points.coordinates(), count);
      NeighbourScratch scratch(count);
      std::vector<std::uint16_t> lists(static_cast<std::size_t>(k * count));
      nearest_points(index, k, 0, index.leaves(), scratch, lists.data());
      for (Index i = 0; i < count; ++i) {
        std::vector<Index> expected = reference::by_distance(points.coordinates(), count, i);
        expected.resize(static_cast<std::size_t>(k));
        std::vector<Index> found(lists.begin() + k * i, lists.begin() + k * (i + 1));
        std::sort(expected.begin(), expected.end());
        std::sort(found.begin(), found.end());
        CAPTURE(count, i);
        REQUIRE(found == expected);
      }
    }
  }
}

TEST_CASE("nearest places equal the full search, the first of equally near ones") {
  Random random(66);
  for (const Index count : {1, 2, 3, 7, 63, 64, 65, 333}) {
    for (const PointSet& points :
         {gaussian(count, random), lattice(count, random), all_equal(count)}) {
      SpatialIndex index(count);
      index.build(points.coordinates(), count);
      NeighbourScratch scratch(count);
      for (const PointSet& queries : {gaussian(65, random), lattice(333, random), points}) {
        constexpr std::uint16_t sentinel = 65535;
        std::vector<std::uint16_t> places(queries.x.size() + 16, sentinel);
        nearest_places(index, queries.coordinates(), queries.count(), scratch, places.data());
        for (Index q = 0; q < queries.count(); ++q) {
          CAPTURE(count, q);
          REQUIRE(places[static_cast<std::size_t>(q)] ==
                  reference::nearest_place(points.coordinates(), count, queries.coordinates(), q));
        }
        REQUIRE(std::all_of(places.begin() + queries.count(), places.end(),
                            [](std::uint16_t v) { return v == sentinel; }));
      }
    }
  }
}

TEST_CASE("an index of every so many points of another in its order searches like its own") {
  Random random(67);
  const PointSet points = clusters(1000, random);
  SpatialIndex whole(1000);
  whole.build(points.coordinates(), 1000);
  for (const Index count : {1, 15, 16, 17, 333, 1000}) {
    PointSet chosen(count);
    std::vector<std::uint32_t> original;
    for (Index i = 0; i < count; ++i) {
      const Index from = i * 1000 / count;
      const Coordinates o = whole.ordered();
      chosen.set(i, o.x[from], o.y[from], o.z[from]);
      original.push_back(static_cast<std::uint32_t>(count - 1 - i));
    }
    SpatialIndex index(1000);
    index.build(points.coordinates(), 1000);  // nothing of it may be left
    index.build_ordered(chosen.coordinates(), original.data(), count);
    REQUIRE(index.count() == count);
    NeighbourScratch scratch(1000);
    const PointSet queries = gaussian(65, random);
    std::vector<std::uint16_t> places(65);
    nearest_places(index, queries.coordinates(), 65, scratch, places.data());
    for (Index q = 0; q < 65; ++q) {
      const Index nearest =
          reference::nearest_place(chosen.coordinates(), count, queries.coordinates(), q);
      CAPTURE(count, q);
      REQUIRE(places[static_cast<std::size_t>(q)] == count - 1 - nearest);
    }
  }
}

TEST_CASE("nearest distances equal the full search, whatever the order of the queries") {
  Random random(64);
  for (const Index count : {1, 2, 3, 7, 63, 64, 65, 333, 1024}) {
    const PointSet points = clusters(count, random);
    SpatialIndex index(count);
    index.build(points.coordinates(), count);
    NeighbourScratch scratch(count);
    for (const PointSet& queries : {gaussian(65, random), clusters(333, random), points}) {
      GuardedFloats squared(queries.count());
      nearest_distances(index, queries.coordinates(), queries.count(), scratch, squared.data());
      REQUIRE(squared.intact());
      for (Index q = 0; q < queries.count(); ++q) {
        CAPTURE(count, q);
        REQUIRE(squared.data()[q] ==
                reference::nearest_distance(points.coordinates(), count, queries.coordinates(), q));
      }
    }
  }
}

TEST_CASE("an index is rebuilt for fewer points without a trace of the points before") {
  Random random(65);
  SpatialIndex index(1024);
  const PointSet many = gaussian(1024, random);
  index.build(many.coordinates(), 1024);
  const PointSet few = gaussian(17, random, 100.0f);
  index.build(few.coordinates(), 17);
  NeighbourScratch scratch(1024);
  std::vector<float> squared(17);
  nearest_distances(index, few.coordinates(), 17, scratch, squared.data());
  REQUIRE(std::all_of(squared.begin(), squared.end(), [](float d) { return d == 0.0f; }));
  nearest_distances(index, many.coordinates(), 1, scratch, squared.data());
  REQUIRE(squared[0] == reference::nearest_distance(few.coordinates(), 17, many.coordinates(), 0));
}

}  // namespace
}  // namespace vnreg::kernels::test
