"""The project's own blind benchmark: drives of a DDAGR made by a simulator that shares no code with ``ddagr_gym``.

``README.md`` in this folder documents protocol, laws, forms and ranges. The pipeline is

    cases.plan -> cases.field_plant -> change.Form.build -> drive.drive -> sensors.readings -> sensors.with_noise

World x, y horizontal; body x forward, y left; yaw counter-clockwise; wheels 1 front right, 2 front left, 3 rear
right, 4 rear left; banks ordered right, left; SI units and radians.
"""
