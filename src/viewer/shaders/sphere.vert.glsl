// A quad that covers the exact silhouette of a sphere for the camera or the sun.
layout(location = 0) in vec4 place;  // centre, radius
layout(location = 1) in vec4 turn;
layout(location = 2) in vec4 paint;  // colour; w: pattern

#ifdef SMOOTH_EDGES
const float kMargin = 0.6;  // pixels, for the outer half of an anti-aliased edge
#else
const float kMargin = 0.0;
#endif

flat out vec4 ball;
flat out vec4 orientation;
flat out vec4 colour;
out vec3 at;

void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  ball = place;
  orientation = turn;
  colour = paint;
  float radius = place.w;
#ifdef SHADOW_PASS
  vec3 side = normalize(abs(sun.y) < 0.9 ? cross(sun.xyz, vec3(0, 1, 0)) : cross(sun.xyz, vec3(1, 0, 0)));
  vec3 up = cross(side, sun.xyz);
  at = vec3(corner, 0.0);
  vec3 p = place.xyz + (sun.xyz + side * corner.x + up * corner.y) * radius;
  gl_Position = vec4((light * vec4(p, 1.0)).xyz * 2.0 - 1.0, 1.0);
#else
  float d = length(place.xyz);
  if (d <= radius * 1.0005) {  // the eye is inside: invisible
    at = vec3(0.0);
    gl_Position = vec4(0.0, 0.0, -2.0, 1.0);
    return;
  }
  // In front of the sphere, so that no fragment lies in front of the quad, and behind the near plane
  // even in the corners of the picture.
  vec3 axis = place.xyz / d;
  float distance = max(d - radius, ray_z.w * 1.01 * length(ray_x.xyz + ray_y.xyz + ray_z.xyz));
  float half_size = distance * radius / sqrt((d - radius) * (d + radius)) + kMargin * pixel_size(distance);
  vec3 side = normalize(abs(axis.y) < 0.9 ? cross(axis, vec3(0, 1, 0)) : cross(axis, vec3(1, 0, 0)));
  vec3 up = cross(side, axis);
  at = axis * distance + (side * corner.x + up * corner.y) * half_size;
  gl_Position = view_projection * vec4(at, 1.0);
#endif
}
