#!/usr/bin/env bash
# Checks that includes between the folders of src point one way, from higher layers to lower ones, and that
# include/jfpx depends on nothing in src. A folder may include itself and every folder listed before it;
# the exceptions below it are folders of the same height that do not use each other.
set -u
cd "$(dirname "$0")/../.."
declare -A allowed=(
  [base]=""
  [ranks]="base"
  [collide]="base"
  [scene]="base collide"
  [sphere_collider]="base collide scene"
  [contact_solver]="base ranks collide scene sphere_collider"
  [world]="base ranks collide scene sphere_collider contact_solver"
  [thesis]="base ranks collide scene sphere_collider contact_solver world"
  [mpi]="base"
  [bullet]="base collide scene sphere_collider contact_solver"
  [scenes]="base"
  [demos]="base scenes"
  [tool]="base ranks collide scene sphere_collider contact_solver world thesis mpi bullet scenes demos"
  [viewer]="base collide scene sphere_collider contact_solver world thesis bullet scenes demos tool"
)
# SceneWorld integrates kinematic bodies with the code of the native world.
exceptions="bullet/world/scene_world.cpp->world"
status=0
arrows=0
for folder in src/*/; do
  folder=$(basename "$folder")
  [ -n "${allowed[$folder]+x}" ] || { echo "src/$folder has no layer: add it to tests/docs/layers.sh"; status=1; }
done
while IFS=: read -r file target; do
  from=${file#src/} from=${from%%/*} to=${target%%/*}
  arrows=$((arrows + 1))
  [ "$from" != "$to" ] || continue
  [[ " $exceptions " != *" ${file#src/}->$to "* ]] || continue
  [[ " ${allowed[$from]-} " == *" $to "* ]] || { echo "$file includes src/$target, but $from may not use $to"; status=1; }
done < <(grep -rHoE '^ *#include "src/[^"]+' src | sed 's/ *#include "src\///')
# Backends of a folder: shared code must not include a backend, and backends do not include each other.
while IFS=: read -r file target; do
  case "$file" in */cpu/*) own=cpu ;; */cuda/*) own=cuda ;; *) own= ;; esac
  case "$target" in */cpu/*) other=cpu ;; */cuda/*) other=cuda ;; *) continue ;; esac
  [ -z "$own" ] || [ "$own" = "$other" ] || { echo "$file includes src/$target, another backend"; status=1; }
done < <(grep -rHoE '^ *#include "src/[^"]+' src | sed 's/ *#include "src\///')
# Folders of src/world, the lowest first. A folder may include those before it, and no file of src/world itself.
world_folders=(bodies contacts joints ranks forces queries character drawing step device cuda snapshots recording)
while IFS=: read -r file target; do
  from=${file#src/world/} to=${target#world/}
  case "$from" in */*) from=${from%%/*} ;; *) continue ;; esac
  case "$to" in */*) to=${to%%/*} ;; *) echo "$file includes src/$target, which is above it"; status=1; continue ;; esac
  # The one file that makes the world on a CUDA device, if there is one.
  [ "$file->$to" != "src/world/device/device_world.cpp->cuda" ] || continue
  [[ " ${world_folders[*]} " == *" $to "*"$from "* || $to = "$from" ]] ||
    { echo "$file includes src/$target, but world/$from may not use world/$to"; status=1; }
done < <(grep -rHoE '^ *#include "src/world/[^"]+' src/world | sed 's/ *#include "src\///')
if grep -rnE '#include "src/|#include <src/' include; then
  echo "include/jfpx may not use src"
  status=1
fi
[ "$arrows" -gt 300 ] || { echo "only $arrows includes were found"; status=1; }
exit $status
