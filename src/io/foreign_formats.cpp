// SPDX-License-Identifier: BSD-3-Clause
#include "io/foreign_formats.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

namespace fcl_fibers::io {
namespace {

constexpr char kMesh[] =
    "a mesh of triangles, which has no fibers; the program takes a Wavefront OBJ file by --mesh";
constexpr char kVtk[] = "a legacy VTK file; save it as XML (.vtp), as ParaView does";
constexpr char kTrx[] = "a TRX file of streamlines; convert it to .tck or .trk";
constexpr char kTt[] = "a TinyTrack file; export it as .trk from DSI Studio";
constexpr char kImage[] = "an image of voxels, which has no fibers";
constexpr char kScene[] =
    "a scene of a 3D program; export the curves as .vtp, or as text with one point x y z per line";
constexpr char kHdf[] =
    "an HDF5 file; export the fibers as .vtp, or as text with one point x y z per line";
constexpr char kNumpy[] =
    "a file of NumPy arrays; write it by fcl_fibers.write() of the Python package";
constexpr char kPacked[] = "packed by a program other than gzip; unpack it first";

/// What a file begins with.
struct Start {
  std::string_view bytes;
  const char* what;
};
constexpr Start kStarts[] = {
    {"# vtk DataFile", kVtk},
    {"ply\n", kMesh},
    {"ply\r", kMesh},
    {"solid ", kMesh},
    {"v ", kMesh},
    {"mtllib ", kMesh},
    {"OFF\n", kMesh},
    {"glTF", kScene},
    {"#usda", kScene},
    {"PXR-USDC", kScene},
    {"Ogawa", kScene},
    {"Kaydara FBX", kScene},
    {"BLENDER", kScene},
    {"\x89HDF", kHdf},
    {"\x93NUMPY", kNumpy},
    {"BZh", kPacked},
    {"\xFD"
     "7zXZ",
     kPacked},
    {"\x28\xB5\x2F\xFD", kPacked},
    {"\x1F\x9D", kPacked},
    {"PK\x03\x04", kPacked},
    {"\x1F\x8B", "packed twice by gzip, or by a method other than deflate; unpack it first"},
};

struct Ending {
  std::string_view ending;
  const char* what;
};
constexpr Ending kEndings[] = {
    {".vtk", kVtk},    {".obj", kMesh},   {".ply", kMesh},    {".stl", kMesh},   {".off", kMesh},
    {".trx", kTrx},    {".tt", kTt},      {".nii", kImage},   {".mif", kImage},  {".nrrd", kImage},
    {".abc", kScene},  {".gltf", kScene}, {".glb", kScene},   {".usd", kScene},  {".usda", kScene},
    {".usdc", kScene}, {".fbx", kScene},  {".blend", kScene}, {".h5", kHdf},     {".hdf5", kHdf},
    {".npy", kNumpy},  {".npz", kNumpy},  {".bz2", kPacked},  {".xz", kPacked},  {".zst", kPacked},
    {".zip", kPacked}, {".7z", kPacked},  {".tar", kPacked},  {".tgz", kPacked},
};

}  // namespace

std::optional<std::string> foreignFormat(std::string_view bytes, const std::string& name) {
  // Some formats are packed themselves, and only their ending tells which they are.
  std::string ending = std::filesystem::path(name).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const Ending& known : kEndings) {
    if (ending == known.ending) return std::string("is ") + known.what;
  }
  for (const Start& start : kStarts) {
    if (bytes.substr(0, start.bytes.size()) == start.bytes) return std::string("is ") + start.what;
  }
  return std::nullopt;
}

}  // namespace fcl_fibers::io
