// Ray-cast sphere with exact silhouette, depth and normal at any size on the screen.
#ifdef GL_ARB_conservative_depth
layout(depth_greater) out float gl_FragDepth;
#endif
flat in vec4 ball;
flat in vec4 orientation;
flat in vec4 colour;
in vec3 at;
#ifndef SHADOW_PASS
layout(location = 0) out vec4 result;
#endif

#ifdef COLOUR_PASS
const vec3 kIvory = vec3(0.86, 0.83, 0.76);
const vec3 kInk = vec3(0.015);

float inside(float signed_distance, float width) {
  return 1.0 - smoothstep(-width, width, signed_distance);
}

// A pool ball seen at the point `d` of its unit sphere: an 8 in a white disk at both poles of z, and
// on every second ball white caps. `width` is the size of a pixel on the unit sphere.
vec3 pool_ball(vec3 d, vec3 base, bool striped, float width) {
  vec3 c = striped ? mix(kIvory, base, inside(abs(d.y) - 0.52, width)) : base;
  float disk = length(d.xy);
  vec2 uv = vec2(d.x * sign(d.z), d.y);
  vec3 disk_colour = kIvory;
  float ring = min(abs(length(uv - vec2(0.0, 0.095)) - 0.075), abs(length(uv + vec2(0.0, 0.105)) - 0.09));
  disk_colour = mix(disk_colour, kInk, inside(ring - 0.030, width));
  return mix(c, disk_colour, inside(disk - 0.36, width));
}
#endif

void main() {
#ifdef SHADOW_PASS
  float rest = 1.0 - dot(at.xy, at.xy);
  if (rest < 0.0) discard;
  gl_FragDepth = clamp(gl_FragCoord.z + (1.0 - sqrt(rest)) * ball.w / shadow.z, 0.0, 1.0);
#else
  vec3 direction = normalize(at);
  float along = dot(direction, ball.xyz);
  vec3 off = direction * along - ball.xyz;
  float miss = length(off);
  float width = pixel_size(along);
  float coverage = clamp((ball.w - miss) / width + 0.5, 0.0, 1.0);
#ifdef SMOOTH_EDGES
  if (coverage <= 0.0) discard;
#else
  if (coverage < 0.5) discard;
#endif
  float inner = sqrt(max(ball.w * ball.w - miss * miss, 0.0));
  vec3 p = direction * (along - inner);
  vec3 n = normalize(p - ball.xyz);
  // A fragment in front of the near plane would violate the conservative depth of the quad.
  gl_FragDepth = max(depth_of(p), gl_FragCoord.z);
#ifdef COLOUR_PASS
  int pattern = int(colour.w * 255.0 + 0.5);
  vec3 base = pow(colour.rgb, vec3(2.2));
  if (pattern == 1 || pattern == 2) {
    float facing = max(dot(n, -direction), 0.15);
    base = pool_ball(rotate_back(orientation, n), base, pattern == 2, width / (ball.w * facing));
  }
  // A ball of a few pixels needs fewer shading samples.
  float taps_wanted = 4.0 + ball.w / width;
  result = vec4(shaded(base, n, p, 1.0, taps_wanted), coverage);
#else
  result = vec4(n, 1.0);
#endif
#endif
}
