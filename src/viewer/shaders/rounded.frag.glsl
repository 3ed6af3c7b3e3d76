// Rounded box, by sphere tracing of its distance function (Hart 1996) inside its bounding box.
flat in vec3 middle;
flat in vec3 core;
flat in vec4 orientation;
flat in vec4 colour;
flat in float radius;
in vec3 at;
#ifndef SHADOW_PASS
layout(location = 0) out vec4 result;
#endif

// From the closest point of the core.
vec3 offset_from_core(vec3 p) { return sign(p) * max(abs(p) - core, 0.0); }

void main() {
#ifdef SHADOW_PASS
  vec3 ray = -sun.xyz;
  vec3 origin = at - ray * 2.0 * length(core + radius);
#else
  vec3 ray = normalize(at), origin = vec3(0.0);
#endif
  vec3 direction = rotate_back(orientation, ray), from = rotate_back(orientation, origin - middle);
  float reach = length(core) + radius, along = max(-dot(from, direction) - reach, 0.0);
  float end = along + 2.0 * reach, tolerance = 1e-4 * radius;
  vec3 offset = vec3(0.0);
  bool hit = false;
  for (int i = 0; i < 64 && along <= end; ++i) {
    offset = offset_from_core(from + direction * along);
    float gap = length(offset) - radius;
    if (gap < tolerance) {
      hit = along > 0.0;
      break;
    }
    along += gap;
  }
  if (!hit) discard;
  vec3 p = origin + ray * along;
#ifdef SHADOW_PASS
  gl_FragDepth = clamp((light * vec4(p, 1.0)).z, 0.0, 1.0);
#else
  vec3 n = rotate(orientation, normalize(offset));
  gl_FragDepth = depth_of(p);
#ifdef COLOUR_PASS
  result = vec4(shaded(pow(colour.rgb, vec3(2.2)), n, p, 0.5, shadow.w), 1.0);
#else
  result = vec4(n, 1.0);
#endif
#endif
}
