# The course in a container; docs/without_installing.md says how it is used. Two images are made of it:
#
#     docker build -t rotflex .                                    what a student has: no solution, no key
#     docker build --target instructor -t rotflex-instructor .     with the instructor's commands and the solutions
#
# The first holds a release. It is made here of the checkout; with a release's folder in place of the dot, and this file
# by -f, it is that one.

FROM debian:trixie-slim AS base
# bubblewrap is for grading, where the host lets a container set up another one inside: `rotflex doctor` tells.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends bubblewrap ca-certificates python3-venv \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --create-home --uid 1000 --shell /bin/bash student
ENV LANG=C.UTF-8

FROM base AS built
WORKDIR /src
COPY . .
RUN if [ ! -d wheels ]; then \
        python3 -m venv /build \
        && /build/bin/pip install --no-cache-dir "./labcourse[grading]" . \
        && /build/bin/rotflex release /release --solutions solutions \
        && cp -r /release/rotflex-course/wheels . ; \
    fi \
    && cp -r wheels /wheels

FROM base AS student
COPY --from=built /wheels /wheels
RUN python3 -m venv /opt/rotflex \
    && /opt/rotflex/bin/pip install --no-cache-dir /wheels/*.whl \
    && rm -r /wheels
ENV PATH=/opt/rotflex/bin:$PATH
USER 1000
WORKDIR /home/student
# A volume that is put here belongs to the student, as this folder does.
RUN mkdir work
EXPOSE 8888
# All of the container's addresses: which of the host's lead to it is said when it is started.
CMD ["rotflex", "lab", "work", "--", "--ip=0.0.0.0", "--port=8888", "--no-browser"]

FROM student AS instructor
USER 0
COPY --from=built /src /src
RUN pip install --no-cache-dir "/src/labcourse[grading]" /src \
    && rm -r /src
USER 1000
RUN mkdir course
COPY --chown=1000:1000 solutions course/solutions
ENV LABCOURSE_SOLUTIONS=/home/student/course/solutions
CMD ["bash"]

# The usual one, as it is the last.
FROM student
