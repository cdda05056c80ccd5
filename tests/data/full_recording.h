#pragma once

#include <string>

#include "tests/data/temporary_folder.h"

namespace clothfit {

/// A recording.yaml that uses every key of the format; the tests refer to its lines.
inline const std::string kFullRecording =
    "format: clothfit-recording/1\n"                                                        // 1
    "name: full\n"                                                                          // 2
    "origin: \"made up: for a test\"\n"                                                     // 3
    "cloth:\n"                                                                              // 4
    "  size: [0.40, 0.30]\n"                                                                // 5
    "  mass: 0.0305\n"                                                                      // 6
    "  masses: equal\n"                                                                     // 7
    "  mesh: {columns: 17, rows: 13}\n"                                                     // 8
    "markers: {kind: apriltag, family: tag36h11, file: markers.csv}\n"                      // 9
    "time: {file: times.csv}\n"                                                             // 10
    "gravity: [0.0, 0.1, -9.81]\n"                                                          // 11
    "cameras:\n"                                                                            // 12
    "  - {name: front, file: cameras/front.yaml, images: frames/front}\n"                   // 13
    "  - name: side\n"                                                                      // 14
    "    images: frames/side.mp4\n"                                                         // 15
    "    calibration:\n"                                                                    // 16
    "      images: calibration/side\n"                                                      // 17
    "      board: {kind: chessboard, columns: 9, rows: 6, square: 0.025}\n"                 // 18
    "observations: {tracks3d: tracks3d.csv, tracks2d: {front: tracks2d/front.csv.gz}}\n"    // 19
    "reference: reference.csv\n"                                                            // 20
    "bodies:\n"                                                                             // 21
    "  - {name: tool, file: tool.csv, clock_offset: unknown, holds: [[0, 0], [0.4, 0]]}\n"  // 22
    "  - {name: arm, file: tool.csv, clock_offset: -0.25, holds: []}\n"                     // 23
    "clouds: {camera: front, files: clouds}\n"                                              // 24
    "held:\n"                                                                               // 25
    "  - {at: [0.0, 0.0], motion: fixed}\n"                                                 // 26
    "  - {at: [0.4, 0.0], motion: path, file: held/right.csv}\n"                            // 27
    "  - {at: [0.2, 0.0], motion: tracked}\n"                                               // 28
    "  - {edge: bottom, motion: fixed}\n"                                                   // 29
    "start: released_flat\n"                                                                // 30
    "declared:\n"                                                                           // 31
    "  - {effect: wind, parameters: {q: [0.0, 0.25, 0.0], c: 0.5}}\n"                       // 32
    "  - effect: viscous_damping\n"                                                         // 33
    "held_out: {from_frame: 2}\n"                                                           // 34
    "obstacle: scene/table.obj\n";                                                          // 35

/// Writes that recording with every file it names.
inline void write_full_recording(const TemporaryFolder& folder) {
  folder.write("recording.yaml", kFullRecording);
  folder.write("markers.csv", "marker,s,t,tag,corner\na,0,0,1,0\nb,0.4,0.3,1,1\n");
  folder.write("times.csv", "frame,time\n0,0.5\n1,0.6\n2,0.75\n");
  folder.write("cameras/front.yaml", "not read here\n");
  folder.write("frames/front/000000.jpg", "not read here");
  folder.write("frames/side.mp4", "not read here");
  folder.write("calibration/side/00.jpg", "not read here");
  folder.write("tracks3d.csv", "frame,marker,x,y,z\n0,a,1,2,3\n");
  folder.write("tracks2d/front.csv.gz", "frame,marker,u,v\n0,a,1,2\n");
  folder.write("reference.csv", "point,x,y,z\nnail,1,2,3\n");
  folder.write("tool.csv", "time,x,y,z,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n");
  folder.write("clouds/000000.csv", "not read here");
  folder.write("scene/table.obj", "v 0 0 0.7\nv 1 0 0.7\nv 1 1 0.7\nf 1 2 3\n");
  folder.write("held/right.csv", "time,x,y,z\n0,1,2,3\n");
}

}  // namespace clothfit
