# Libraries that benchmarks and the scoreboard run beside this one, where they are installed. Each
# that is found is the target fcl_fibers_peer_NAME.

find_package(embree 4 QUIET)
if(NOT embree_FOUND)
  find_package(embree 3 QUIET)
endif()
if(embree_FOUND)
  add_library(fcl_fibers_peer_embree INTERFACE)
  target_link_libraries(fcl_fibers_peer_embree INTERFACE embree)
  target_compile_definitions(fcl_fibers_peer_embree INTERFACE
    FCL_FIBERS_WITH_EMBREE=${embree_VERSION_MAJOR})
endif()

# SYSTEM: the headers of these have warnings of their own.
find_path(FCL_FIBERS_BULLET_INCLUDE BulletCollision/BroadphaseCollision/btDbvt.h
  PATH_SUFFIXES bullet)
find_library(FCL_FIBERS_BULLET_COLLISION BulletCollision)
find_library(FCL_FIBERS_LINEAR_MATH LinearMath)
if(FCL_FIBERS_BULLET_INCLUDE AND FCL_FIBERS_BULLET_COLLISION AND FCL_FIBERS_LINEAR_MATH)
  add_library(fcl_fibers_peer_bullet INTERFACE)
  target_link_libraries(fcl_fibers_peer_bullet INTERFACE
    ${FCL_FIBERS_BULLET_COLLISION} ${FCL_FIBERS_LINEAR_MATH})
  target_include_directories(fcl_fibers_peer_bullet SYSTEM INTERFACE ${FCL_FIBERS_BULLET_INCLUDE})
endif()

find_path(FCL_FIBERS_COAL_INCLUDE coal/collision.h)
find_library(FCL_FIBERS_COAL coal)
if(FCL_FIBERS_COAL_INCLUDE AND FCL_FIBERS_COAL)
  add_library(fcl_fibers_peer_coal INTERFACE)
  target_link_libraries(fcl_fibers_peer_coal INTERFACE ${FCL_FIBERS_COAL})
  target_include_directories(fcl_fibers_peer_coal SYSTEM INTERFACE ${FCL_FIBERS_COAL_INCLUDE})
  file(STRINGS ${FCL_FIBERS_COAL_INCLUDE}/coal/config.hh FCL_FIBERS_COAL_VERSION
    REGEX "define COAL_VERSION ")
  string(REGEX REPLACE ".*\"(.*)\"" "\\1" FCL_FIBERS_COAL_VERSION "${FCL_FIBERS_COAL_VERSION}")
  target_compile_definitions(fcl_fibers_peer_coal INTERFACE FCL_FIBERS_WITH_COAL)
endif()
