# Finds three.js, which goes into the program, and from there into its pages. Debian: libjs-three.
find_path(FCL_FIBERS_THREE_DIR build/three.min.js
  PATHS /usr/share/javascript/three /usr/share/nodejs/three
  DOC "Folder of three.js, with build/three.min.js and examples/js/controls/OrbitControls.js"
  NO_DEFAULT_PATH)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(threejs REQUIRED_VARS FCL_FIBERS_THREE_DIR)
