// Uniforms of a frame, shared by all shaders. Positions are relative to the eye, in world axes, which
// preserves the precision of large coordinates.
layout(std140) uniform Frame {
  mat4 view_projection;
  mat4 light;      // position -> shadow map: xy and depth in [0, 1]
  vec4 ray_x;      // half a viewport to the right at distance 1; w: vertical extent of a pixel at 1
  vec4 ray_y;      // half a viewport up
  vec4 ray_z;      // forward; w: near plane
  vec4 sun;        // direction towards the sun; w: tangent of its blur
  vec4 viewport;   // width, height in samples; z: far plane; w: samples per unit of line widths
  vec4 shadow;     // metres per texel, width and depth in metres; w: taps, 0 for no shadows
  vec4 occlusion;  // radius in metres; y: samples, 0 for none; z: distance of full fog
  vec4 taps[MAX_TAPS];  // direction by the golden angle; z: radius on a disk of radius sqrt(taps)
};

float pixel_size(float at_distance) { return ray_x.w * at_distance; }

vec3 rotate(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
vec3 rotate_back(vec4 q, vec3 v) { return rotate(vec4(-q.xyz, q.w), v); }

float depth_of(vec3 p) {
  vec4 clip = view_projection * vec4(p, 1.0);
  return clamp(0.5 + 0.5 * clip.z / clip.w, 0.0, 0.9999999);
}
