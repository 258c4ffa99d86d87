// Embree 3 as the tracer's peer: the same triangles, the same rays, its 8-ray packets, one thread.
//
//     embree TRIANGLES RAYS ANSWERS PASSES [QUALITY] [robust]
//
// Inputs: TRIANGLES, nine floats each (metres); RAYS, blocks of sixteen: origin x, y, z, direction x, y, z, least and greatest distance,
// sixteen floats each. Outputs: ANSWERS, per block sixteen distances and sixteen triangles (all bits set: none); on the standard output one
// line of JSON with the best pass' seconds. PASSES counts the timed ones, after one that is not. QUALITY is medium (default) or high.

#include <embree3/rtcore.h>
#include <immintrin.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

static const size_t LANES = 16;

struct Block {
  float origin[3][LANES], direction[3][LANES], t_min[LANES], t_max[LANES];
};

struct Answer {
  float t[LANES];
  uint32_t triangle[LANES];
};

[[noreturn]] static void fail(const std::string& reason) {
  std::fprintf(stderr, "%s\n", reason.c_str());
  std::exit(1);
}

template <typename T>
static std::vector<T> read(const char* path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) fail(std::string("cannot read ") + path);
  const size_t bytes = size_t(file.tellg());
  if (bytes == 0 || bytes % sizeof(T) != 0) fail(std::string("no whole records in ") + path);
  std::vector<T> values(bytes / sizeof(T));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(values.data()), std::streamsize(bytes));
  if (!file) fail(std::string("cannot read all of ") + path);
  return values;
}

struct Triangle {
  float corners[3][3];
};

static RTCScene scene_of(RTCDevice device, const std::vector<Triangle>& triangles, bool high, bool robust) {
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneBuildQuality(scene, high ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM);
  if (robust) rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryBuildQuality(geometry, high ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM);
  void* corners = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * triangles.size());
  std::memcpy(corners, triangles.data(), triangles.size() * sizeof(Triangle));
  auto* indices = static_cast<uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(uint32_t), triangles.size()));
  for (size_t corner = 0; corner < 3 * triangles.size(); ++corner) indices[corner] = uint32_t(corner);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  return scene;
}

// Each block as two packets of eight: of four by four pixels the upper and the lower two rows.
static std::vector<RTCRay8> packets_of(const std::vector<Block>& blocks) {
  std::vector<RTCRay8> packets(2 * blocks.size());
  for (size_t packet = 0; packet < packets.size(); ++packet) {
    const Block& block = blocks[packet / 2];
    RTCRay8& ray = packets[packet];
    std::memset(&ray, 0, sizeof ray);
    for (size_t lane = 0; lane < 8; ++lane) {
      const size_t from = 8 * (packet % 2) + lane;
      ray.org_x[lane] = block.origin[0][from];
      ray.org_y[lane] = block.origin[1][from];
      ray.org_z[lane] = block.origin[2][from];
      ray.dir_x[lane] = block.direction[0][from];
      ray.dir_y[lane] = block.direction[1][from];
      ray.dir_z[lane] = block.direction[2][from];
      ray.tnear[lane] = block.t_min[from];
      ray.tfar[lane] = block.t_max[from];
      ray.mask[lane] = 0xFFFFFFFFu;
    }
  }
  return packets;
}

static void trace(RTCScene scene, const std::vector<RTCRay8>& packets, std::vector<Answer>& answers) {
  alignas(32) static const int all[8] = {-1, -1, -1, -1, -1, -1, -1, -1};
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  for (size_t packet = 0; packet < packets.size(); ++packet) {
    RTCRayHit8 work;
    work.ray = packets[packet];
    for (size_t lane = 0; lane < 8; ++lane) work.hit.geomID[lane] = work.hit.primID[lane] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect8(all, scene, &context, &work);
    Answer& answer = answers[packet / 2];
    std::memcpy(answer.t + 8 * (packet % 2), work.ray.tfar, sizeof work.ray.tfar);
    std::memcpy(answer.triangle + 8 * (packet % 2), work.hit.primID, sizeof work.hit.primID);
  }
}

int main(int count, char** arguments) {
  if (count < 5) fail("usage: embree TRIANGLES RAYS ANSWERS PASSES [QUALITY] [robust]");
  // As Embree's manual asks of its users.
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
  const auto triangles = read<Triangle>(arguments[1]);
  const auto packets = packets_of(read<Block>(arguments[2]));
  const bool high = count > 5 && std::string(arguments[5]) == "high";
  const bool robust = count > 6 && std::string(arguments[6]) == "robust";
  RTCDevice device = rtcNewDevice("threads=1");
  if (!device) fail("Embree makes no device");
  RTCScene scene = scene_of(device, triangles, high, robust);
  if (rtcGetDeviceError(device) != RTC_ERROR_NONE) fail("Embree builds no scene");
  std::vector<Answer> answers(packets.size() / 2);
  double best_s = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass <= std::atoi(arguments[4]); ++pass) {
    const auto begin = std::chrono::steady_clock::now();
    trace(scene, packets, answers);
    const double taken_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (pass > 0 && taken_s < best_s) best_s = taken_s;
  }
  std::ofstream file(arguments[3], std::ios::binary);
  file.write(reinterpret_cast<const char*>(answers.data()), std::streamsize(answers.size() * sizeof(Answer)));
  file.close();
  if (!file) fail(std::string("cannot write ") + arguments[3]);
  std::printf("{\"seconds\":%.9f,\"rays\":%zu}\n", best_s, 8 * packets.size());
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
  return 0;
}
